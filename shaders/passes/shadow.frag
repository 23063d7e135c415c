// Depth alone; leaves keep their holes.
#include <material>

in vec3 position_world;
in vec3 normal_world;
in vec2 surface_uv;
in vec4 surface_color;

void main()
{
#ifdef HAS_ALPHA_CUTOFF
    if (material_surface(position_world, normal_world, surface_uv, surface_color).alpha < material.alpha_cutoff)
        discard;
#endif
}
