// The water's plane within its extents.
#include <View>
#include <WaterPlane>


uniform int cells;  // that the rectangle is divided into, each way

#include <shape>

out vec3 position_world;
out vec4 reflection_clip;
out vec4 refraction_clip;
out vec3 shadow_place;

void main()
{
    int number = gl_VertexID % 6;
    vec2 corner = vec2(number == 1 || number == 2 || number == 4, number > 1 && number != 3);
    int cell = gl_VertexID / 6;
    corner = (corner + vec2(cell % cells, cell / cells)) / float(cells);
    vec4 e = water_plane.extents;
    position_world = vec3(mix(e.x, e.y, corner.x), water_plane.level, mix(e.z, e.w, corner.y));
    position_world.y += surface_height(position_world.xz);
    reflection_clip = water_plane.reflection_from_world * vec4(position_world, 1.0);
    refraction_clip = water_plane.refraction_from_world * vec4(position_world, 1.0);
#ifdef HAS_SHADOWS
    shadow_place = (view.shadow_from_world * vec4(position_world, 1.0)).xyz;
#else
    shadow_place = vec3(0.0);
#endif
    gl_Position = view.clip_from_world * vec4(position_world, 1.0);
}
