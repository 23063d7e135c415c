// The ground: one baked colour map over all of it times one tiling detail map, two fetches in all. The colour map's alpha
// chooses between the detail map's two patterns: 0 stones and sand (blue), 1 grass (alpha).
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
    vec2 tilt = (2.0 * detail.rg - 1.0) * mix(1.0, GRASS_RELIEF, base.a);
    float shade = 2.0 * mix(detail.b, detail.a, base.a);
    vec3 albedo = material.albedo * color.rgb * linear_from_root(base.rgb) * shade;
    return Surface(albedo, normalize(normal_world + vec3(tilt.x, 0.0, tilt.y)), 1.0, 0.0);
}
