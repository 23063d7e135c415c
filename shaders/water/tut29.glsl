// Water after Rastertek n.d., tutorial 29: rows of the document in its own terms.
// Document's space: u to the right, v downwards, both 0..1 over the picture; ours has v upwards.
#include <Tut29>
#include <Tut29Scroll>
#include "water/interface.glsl"
#include "lib/normals.glsl"

uniform sampler2D normal_map;
uniform sampler2D reflection_map;
uniform sampler2D refraction_map;

// Rastertek n.d., pixel shader: x and y of the map's normal, expanded from 0..1. place: tiles.
vec2 expanded_normal(vec2 place)
{
    return 2.0 * texture(normal_map, place).rg - 1.0;
}

// Slope of the surface whose unit normal has these horizontal components, and back. The floor of the third keeps it finite.
vec2 slope_of_normal(vec2 n)
{
    return n * inversesqrt(max(1.0 - dot(n, n), 1e-4));
}

vec2 normal_of_slope(vec2 slope)
{
    return slope * inversesqrt(1.0 + dot(slope, slope));
}

// Horizontal components of the normal where the map has scrolled. place: 0..1 over the water's rectangle.
vec2 tut29_normal(vec2 place)
{
    place *= tut29.tiling;
    vec2 now = expanded_normal(place + tut29_scroll.offset.xy);
#ifdef TWO_PHASES
    vec2 before = expanded_normal(place + tut29_scroll.offset.zw);
    return normal_of_slope(blended_slope(slope_of_normal(now), slope_of_normal(before), tut29_scroll.earlier));
#else
    return now;
#endif
}

WaterShade shade_water(WaterPoint point)
{
    vec2 shift = tut29_normal(point.plane_place) * tut29.reflect_refract_scale;
    // The document's +v is down in both of its maps. Its reflection is upside down against the true mirror's, so what is
    // down in the one is up in the other.
    vec2 refraction_shift = vec2(shift.x, -shift.y);
#ifdef AS_PUBLISHED
    vec2 reflection_shift = refraction_shift;
#else
    vec2 reflection_shift = shift;
#endif
    vec4 refracted = texture(refraction_map, point.refraction_place + refraction_shift);
    float validity = 1.0;
#ifndef AS_PUBLISHED
    // A ripple that looks past the water's edge would draw the map's clear colour, or what stands in the air, onto the
    // water: there both maps are read where they lie.
    if (refracted.a < 0.5)
    {
        refracted = texture(refraction_map, point.refraction_place);
        reflection_shift = vec2(0.0);
        validity = 0.0;
    }
#endif
    vec3 reflected = texture(reflection_map, point.reflection_place + reflection_shift).rgb;
    vec3 radiance = mix(reflected, refracted.rgb, tut29.blend);
    return WaterShade(radiance, 1.0, 1.0 - tut29.blend, reflection_shift, validity);
}
