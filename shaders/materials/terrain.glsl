// The ground: one baked colour map over all of it times one tiling detail map, two fetches in all. The colour map's alpha
// says how much of which of the detail map's two patterns shows: 0 stones (blue), 1 grass (alpha), plain halfway.
#include <Material>
#include "lib/surface.glsl"
#include "lib/colour.glsl"

uniform sampler2D albedo_map;
uniform sampler2D detail_map;

const float GRASS_RELIEF = 0.25;  // share of the stones' relief that grass shows

Surface material_surface(vec3 position_world, vec3 normal_world, vec2 uv, vec4 color)
{
    vec4 base = texture(albedo_map, uv);
    vec4 detail = texture(detail_map, position_world.xz / material.detail_tile);
    float grass = max(2.0 * base.a - 1.0, 0.0);
    float stones = max(1.0 - 2.0 * base.a, 0.0);
    float shade = 1.0 + stones * (2.0 * detail.b - 1.0) + grass * (2.0 * detail.a - 1.0);
    vec2 tilt = (2.0 * detail.rg - 1.0) * (stones + GRASS_RELIEF * grass);
    // The ground has no vertex colours: unread, they need not be interpolated.
    vec3 albedo = material.albedo * linear_from_root(base.rgb) * shade;
    return Surface(albedo, normalize(normal_world + vec3(tilt.x, 0.0, tilt.y)), 1.0, 0.0);
}
