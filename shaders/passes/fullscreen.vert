// A triangle that covers the target, at the farthest depth; its rays look into the world.
#include <View>

out vec3 ray_world;

void main()
{
    vec2 ndc = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    ray_world = (view.ray_from_ndc * vec4(ndc, 1.0, 0.0)).xyz;
    gl_Position = vec4(ndc, 0.0, 1.0);
}
