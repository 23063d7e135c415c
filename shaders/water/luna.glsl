// Pond water after Luna 2006: rows of the document in its own terms, in linear light.
// Document's space: u to the right, v downwards, both 0..1 over the picture; ours has v upwards.
#include <Luna>
#include <LunaScroll>
#include <Light>
#include "water/interface.glsl"
#include "lib/fresnel.glsl"
#include "lib/layering.glsl"
#include "lib/microfacet.glsl"
#include "lib/normals.glsl"

uniform sampler2D normal_map_0;
uniform sampler2D normal_map_1;
uniform sampler2D reflection_map;
uniform sampler2D refraction_map;
#ifdef HAS_BIAS_MAP
uniform sampler2D bias_map;
#endif
#ifdef HAS_COLOR_LAYERS
uniform sampler2D color_layer_map_0;
#endif
#ifdef HAS_TWO_COLOR_LAYERS
uniform sampler2D color_layer_map_1;
#endif

// Slope of one scrolling map. place: tiles; offset: now and one period earlier, tiles.
vec2 scrolled_slope(sampler2D map, vec2 place, vec4 offset, float earlier)
{
    vec2 now = texture(map, place + offset.xy).rg;
#ifdef TWO_PHASES
    return blended_slope(now, texture(map, place + offset.zw).rg, earlier);
#else
    return now;
#endif
}

// Luna 2006, section 3: the mean of two scrolling normals, normalised.
vec3 luna_normal(vec2 place)
{
    vec2 slope_0 = scrolled_slope(normal_map_0, place / luna.tile_0, luna_scroll.offset_0, luna_scroll.blend_0);
    vec2 slope_1 = scrolled_slope(normal_map_1, place / luna.tile_1, luna_scroll.offset_1, luna_scroll.blend_1);
    return normalize(0.5 * (normal_from_slope(luna.ripple_height * slope_0) + normal_from_slope(luna.ripple_height * slope_1)));
}

// Luna 2006, section 4: the shift fades to nothing towards the picture's bottom, v = 1, where it would leave the map.
float bottom_damping(float v)
{
    float v2 = v * v;
    float v8 = v2 * v2 * v2 * v2;
    return 1.0 - v8 * v2;
}

// Luna 2006, section 3: a place in a map moved by the ripples. place: v upwards.
vec2 rippled(vec2 place, vec3 n)
{
    vec2 shift = n.xz * luna.ripple_scale;
    shift.y *= bottom_damping(1.0 - place.y);
    return vec2(place.x + shift.x, place.y - shift.y);
}

// Luna 2006, section 4: how much is refracted. n: the rippled normal.
float luna_weight(WaterPoint point, vec3 n)
{
#ifdef HAS_BIAS_MAP
    float bias = texture(bias_map, point.plane_place).r;
#else
    float bias = luna.refraction_bias;
#endif
    float weight = luna_refraction_weight(dot(n, point.view), bias, luna.refraction_power);
#ifdef NEEDS_DEPTH
    weight *= refraction_weight_left(luna.depth_fade, point.depth);
#endif
#ifdef NEEDS_DISTANCE
    weight *= refraction_weight_left(luna.distance_fade, point.distance);
#endif
    return weight;
}

// Luna 2006, section 2.3: the refracted light behind one layer of impurities. place: metres; look: tile in metres,
// opacity, and the weight of the earlier phase.
vec3 behind_layer(vec3 refracted, sampler2D map, vec2 place, vec4 offset, vec4 look)
{
    vec4 layer = texture(map, place / look.x - offset.xy);
#ifdef TWO_PHASES
    layer = mix(layer, texture(map, place / look.x - offset.zw), look.z);
#endif
    return layered(refracted, layer, look.y);
}

WaterShade shade_water(WaterPoint point)
{
    vec3 n = luna_normal(point.position.xz);
    n.y *= point.up.y;
    // A ripple that looks past the water's edge, at something that stands in the air, would draw that thing or the hole
    // behind it onto the water: there both maps are read where they lie.
    vec4 refracted = texture(refraction_map, rippled(point.refraction_place, n));
    vec2 reflection_place = rippled(point.reflection_place, n);
    bool leaks = refracted.a < 0.5;
#ifndef READS_LEAKS
    if (leaks)
    {
#ifdef REFRACTION_IS_ALIGNED
        refracted = texelFetch(refraction_map, ivec2(gl_FragCoord.xy), 0);
#else
        refracted = texture(refraction_map, point.refraction_place);
#endif
        reflection_place = point.reflection_place;
    }
#endif
    vec3 reflected = texture(reflection_map, reflection_place).rgb;

#ifdef HAS_COLOR_LAYERS
    refracted.rgb = behind_layer(refracted.rgb, color_layer_map_0, point.position.xz, luna_scroll.layer_offset_0, luna_scroll.layer_look_0);
#endif
#ifdef HAS_TWO_COLOR_LAYERS
    refracted.rgb = behind_layer(refracted.rgb, color_layer_map_1, point.position.xz, luna_scroll.layer_offset_1, luna_scroll.layer_look_1);
#endif

    float weight = luna_weight(point, n);
    vec3 blend = mix(reflected, refracted.rgb, weight);

    float sun = max(light.sun_radiance.r, max(light.sun_radiance.g, light.sun_radiance.b)) > 0.0 ? 1.0 : 0.0;
    float NoL = max(dot(n, light.sun_direction), 0.0);
    float glint = phong_lobe(n, light.sun_direction, point.view, luna.specular_power) * point.sun_visibility;
    vec3 radiance = blend * (luna.material_ambient * luna.light_ambient + luna.material_diffuse * luna.light_diffuse * (sun * NoL))
        + luna.material_specular * luna.light_specular * (sun * glint);
    return WaterShade(radiance, 1.0, 1.0 - weight, reflection_place - point.reflection_place, leaks ? 0.0 : 1.0);
}
