// Lake water after Habib 2009.
#include <Lake>
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
    vec2 now = texture(bump_map, lake_bump_place(place, lake_wind.turn, lake.wave_length, lake_wind.offset.xy)).rg;
#ifdef TWO_PHASES
    vec2 before = texture(bump_map, lake_bump_place(place, lake_wind.turn, lake.wave_length, lake_wind.offset.zw)).rg;
    return blended_slope(now, before, lake_wind.blend);
#else
    return now;
#endif
}

WaterShade shade_water(WaterPoint point)
{
    vec3 n = normal_from_slope(bump_slope(point.plane_place));
    vec2 perturbation = lake_perturbation(n, lake.wave_height);

    vec2 reflection_place = lake_moved(point.reflection_place, perturbation);
    vec4 refracted = texture(refraction_map, lake_moved(point.refraction_place, perturbation));
    bool leaks = false;
#ifndef IS_ENCODED
    // A wave that looks past the water's edge, at something that stands in the air, would draw that thing or the hole
    // behind it onto the water: there both maps are read where they lie. Over no ground at all the reflection has no such
    // edge.
    if (refracted.a < 0.5)
    {
        refracted = texture(refraction_map, point.refraction_place);
        leaks = refracted.a >= 0.5;
        if (leaks)
            reflection_place = point.reflection_place;
    }
#endif
    vec3 reflected = texture(reflection_map, reflection_place).rgb;

    float NoV = clamp(dot(point.view, point.up), 0.0, 1.0);
#if FRESNEL_MODE == 0
    float fresnel = lake_fresnel_projected(NoV);
#elif FRESNEL_MODE == 1
    float fresnel = lake_fresnel_power(NoV);
#else
    float fresnel = lake_fresnel_inverse(NoV);
#endif
    float weight = lake_reflection_weight(fresnel, lake.draw_mode);
    vec3 combined = refracted.rgb * (1.0 - weight) + reflected * weight;
    vec3 dulled = mix(combined, lake_color(lake.dull_color), lake.dull_blend_factor);

    // The highlight's alpha is scaled as its colour is: its weight counts twice.
    float t = lake_highlight(point.view, normalize(lake.light_direction), point.up, perturbation, lake.spec_perturb, lake.spec_power);
    vec3 radiance = dulled + lake_color(lake.spec_color) * (lake.spec_alpha * t * t);
    return WaterShade(radiance, 1.0, weight, reflection_place - point.reflection_place, leaks ? 0.0 : 1.0);
}
