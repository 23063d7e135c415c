// Waves, highlight and Fresnel terms of the two lake articles. Their z-up world (x, y, z) is (x, z, -y) here.
#include "lib/colour.glsl"

// Habib 2009, "Fresnel term", first mode: the projection of the eye vector, corrected. NoV: cosine of the view angle.
float lake_fresnel_projected(float NoV)
{
    return 1.0 - 1.3 * NoV;
}

// Habib 2009, "Fresnel term", second mode: Schlick's shape between 0.02 and 0.99. NoV: 0..1.
float lake_fresnel_power(float NoV)
{
    float grazing = 1.0 - NoV;
    float grazing2 = grazing * grazing;
    return 0.02 + 0.97 * grazing2 * grazing2 * grazing;
}

// Habib 2009, "Fresnel term", third mode: from 1/32 head on to 1. NoV: 0..1.
float lake_fresnel_inverse(float NoV)
{
    float facing = 1.0 + NoV;
    float facing2 = facing * facing;
    return 1.0 / (facing2 * facing2 * facing);
}

// Habib 2009, "Fresnel term": share of the reflection, a Fresnel term times the user's factor, then cut to 0..1.
float lake_reflection_weight(float fresnel, float draw_mode)
{
    return clamp(fresnel * draw_mode, 0.0, 1.0);
}

// Habib 2009, "Waves": the bump map's place. plane_place: 0..1 over the plane; turn: cosine and sine of the wind's
// direction; wave_length: share of the plane; offset: tiles. The place is turned first and divided then; the offset
// is not turned.
vec2 lake_bump_place(vec2 plane_place, vec2 turn, float wave_length, vec2 offset)
{
    vec2 turned = vec2(plane_place.x * turn.x - plane_place.y * turn.y, plane_place.x * turn.y + plane_place.y * turn.x);
    return turned / wave_length + offset;
}

// Habib 2009, "Waves": wave height times (red, green - 1/2) of the bump map, that is half the normal's x and y; their y
// is our -z. n: unit, y up. Exactly zero for the flat normal. The result is in their texture coordinates, v downwards.
vec2 lake_perturbation(vec3 n, float wave_height)
{
    return wave_height * 0.5 * vec2(n.x, -n.z);
}

// A map's place, v upwards, moved by a perturbation, whose v runs downwards.
vec2 lake_moved(vec2 place, vec2 perturbation)
{
    return vec2(place.x + perturbation.x, place.y - perturbation.y);
}

// Habib 2009, "Specular highlights": power of the cosine between the plane's normal and the perturbed half vector.
// v l up: unit, away from the surface; perturbation: as lake_perturbation gives it. Nothing where the light stands on
// the other side of the plane, and never the power of a negative number.
float lake_highlight(vec3 v, vec3 l, vec3 up, vec2 perturbation, float spec_perturb, float spec_power)
{
    vec3 h = normalize(v + l + spec_perturb * vec3(perturbation.x, 0.0, -perturbation.y));
    float NoH = dot(h, up);
    return NoH > 0.0 && dot(l, up) > 0.0 ? pow(NoH, spec_power) : 0.0;
}

// A colour as the maps hold it: encoded for display as published, else linear. linear: 0..1 where encoded.
vec3 lake_color(vec3 linear)
{
#ifdef IS_ENCODED
    return srgb_from_linear(clamp(linear, 0.0, 1.0));
#else
    return linear;
#endif
}

// What a map holds, as the display shows it.
vec3 lake_displayed(vec3 held)
{
#ifdef IS_ENCODED
    return held;
#else
    return srgb_from_linear(clamp(held, 0.0, 1.0));
#endif
}
