// Air that scatters light, exponential in distance and in height above the water.
#include <Fog>
#include <Light>

// (1 - exp(-t)) / t, the mean of exp(-t) from 0 to t >= 0. The quotient loses its digits near 0, where a series stands in.
float falling_mean(float t)
{
    float series = 1.0 - t * (0.5 - t * (1.0 / 6.0 - t / 24.0));
    return t < 0.03 ? series : (1.0 - exp(-t)) / t;
}

// Light that comes through from a point to the eye, by Beer's law: exp(-density * mean * distance), where mean is the
// closed form of exp(-k |y|) averaged along the way.
// y_eye, y_point: heights above the water, metres; the mirrored eye lies below, so height counts as |y|,
// which gives a reflection the fog of its whole path. distance: metres.
float fog_transmittance(float y_eye, float y_point, float distance)
{
    float k = fog.height_falloff;
    float low = min(abs(y_eye), abs(y_point));
    float high = max(abs(y_eye), abs(y_point));
    float mean;
    if (y_eye * y_point < 0.0)
        mean = (low * falling_mean(k * low) + high * falling_mean(k * high)) / (low + high);
    else
        mean = exp(-k * low) * falling_mean(k * (high - low));
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
