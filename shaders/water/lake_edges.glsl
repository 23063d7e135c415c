// Lake water with natural edges after Habib 2009b.
#include <LakeEdges>
#include <LakeWind>
#include "water/interface.glsl"
#include "lib/lake.glsl"
#include "lib/normals.glsl"

uniform sampler2D bump_map;
uniform sampler2D reflection_map;
uniform sampler2D refraction_map;

// Slope of the moving bump map. place: 0..1 over the plane.
vec2 bump_slope(vec2 place)
{
    vec2 now = texture(bump_map, lake_bump_place(place, lake_wind.turn, lake_edges.wave_length, lake_wind.offset.xy)).rg;
#ifdef TWO_PHASES
    vec2 before = texture(bump_map, lake_bump_place(place, lake_wind.turn, lake_edges.wave_length, lake_wind.offset.zw)).rg;
    return blended_slope(now, before, lake_wind.blend);
#else
    return now;
#endif
}

// Habib 2009b, "Fading artifacts": 1 where a map shows something, 0 where it shows its clear colour. read: of the map,
// filtered, through the waves; blank: alpha where nothing is drawn.
float map_validity(vec4 read, float blank)
{
    bool is_valid = true;
#ifndef KEYS_BY_ALPHA
    vec3 apart = abs(lake_displayed(read.rgb) - lake_displayed(lake_color(lake_edges.clear_color)));
    is_valid = apart.r + apart.g + apart.b >= lake_edges.key_threshold;
#endif
#if defined(KEYS_BY_ALPHA) || !defined(IS_ENCODED)
    // A place that is drawn in part has the clear colour mixed in by the filter: a line along the shore.
    is_valid = is_valid && abs(read.a - blank) > 0.99;
#endif
    return is_valid ? 1.0 : 0.0;
}

WaterShade shade_water(WaterPoint point)
{
    vec3 n = normal_from_slope(bump_slope(point.plane_place));
    vec2 perturbation = lake_perturbation(n, lake_edges.wave_height);
    vec2 reflection_place = lake_moved(point.reflection_place, perturbation);
    vec4 reflected = texture(reflection_map, reflection_place);
    vec4 refracted = texture(refraction_map, lake_moved(point.refraction_place, perturbation));
    float validity = map_validity(reflected, 1.0) * map_validity(refracted, 0.0);

    float NoV = clamp(dot(point.view, point.up), 0.0, 1.0);
#if FRESNEL_MODE == 1
    float fresnel = lake_fresnel_power(NoV);
#else
    float fresnel = lake_fresnel_projected(NoV);
#endif
    float weight = lake_reflection_weight(fresnel, lake_edges.draw_mode);
    vec3 combined = (refracted.rgb * (1.0 - weight) + reflected.rgb * weight) * validity;
    // The factor counts for the opacity too; the highlight adds nothing to that.
    vec3 tinted = lake_edges.dull_blend_factor * combined * lake_edges.tint;
    float opacity = lake_edges.dull_blend_factor * validity;

    // The highlight's alpha is scaled as its colour is: its weight counts twice.
    float t = lake_highlight(point.view, normalize(lake_edges.light_direction), point.up, perturbation, lake_edges.spec_perturb, lake_edges.spec_power);
    vec3 radiance = tinted + lake_color(lake_edges.spec_color) * (lake_edges.spec_alpha * t * t);
    return WaterShade(radiance, opacity, weight, reflection_place - point.reflection_place, validity);
}
