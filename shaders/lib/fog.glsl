// Air that scatters light, exponential in distance and in height above the water.
#include <Fog>
#include <Light>

// Integral of exp(-k |y|) from 0 to y, for k > 0.
float fog_column(float y, float k)
{
    return sign(y) * (1.0 - exp(-k * abs(y))) / k;
}

// Light that comes through from a point to the eye: closed form of the exponential column.
// y_eye, y_point: heights above the water, metres; the mirrored eye lies below, so height counts as |y|,
// which gives a reflection the fog of its whole path. distance: metres.
float fog_transmittance(float y_eye, float y_point, float distance)
{
    float k = fog.height_falloff;
    float rise = y_point - y_eye;
    float mean = 1.0;
    if (k > 0.0)
        mean = abs(rise) > 1e-3 ? (fog_column(y_point, k) - fog_column(y_eye, k)) / rise : exp(-k * abs(y_eye));
    return exp(-fog.density * mean * distance);
}

// A surface's light with the fog before it.
vec3 fogged(vec3 radiance, vec3 eye, vec3 position)
{
    float through = fog_transmittance(eye.y - light.water_level, position.y - light.water_level, distance(eye, position));
    return mix(fog.color, radiance, through);
}

// The sky's light behind the whole depth of the fog. direction: unit. Level or falling rays never leave it.
vec3 fogged_sky(vec3 radiance, vec3 eye, vec3 direction)
{
    float k = fog.height_falloff;
    float h = abs(eye.y - light.water_level);
    float through = k > 0.0 && direction.y > 0.0 ? exp(-fog.density * exp(-k * h) / (k * direction.y)) : 0.0;
    return mix(fog.color, radiance, through);
}
