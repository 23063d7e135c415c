// First step of the sky: light scattered twice or more, by height and sun, for sunlight of irradiance 1.
#include <AnalyticSky>
#include "lib/atmosphere.glsl"
#include "lib/sky.glsl"

layout(location = 0) out vec4 multiple_scattering;

const int DIRECTIONS = 8;  // a square of them
const int STEPS = 20;

// Hillaire 2020, section 5.5, equations 5 to 10: second order from all round, later orders as a geometric series.
vec4 scattered_more(float h, float mu, float turbidity)
{
    vec4 aerosol = aerosol_extinction(turbidity);
    vec4 second = vec4(0.0);
    vec4 passed_on = vec4(0.0);
    float sine_sun = sqrt(max(0.0, 1.0 - mu * mu));
    for (int i = 0; i < DIRECTIONS * DIRECTIONS; ++i)
    {
        float y = 1.0 - (2.0 * float(i / DIRECTIONS) + 1.0) / float(DIRECTIONS);
        float azimuth = (float(i % DIRECTIONS) + 0.5) / float(DIRECTIONS) * 2.0 * PI;
        float horizontal = sqrt(1.0 - y * y);
        vec3 d = vec3(cos(azimuth) * horizontal, y, sin(azimuth) * horizontal);
        float r = PLANET_RADIUS + h;
        float to_ground = r * r * (y * y - 1.0) + PLANET_RADIUS * PLANET_RADIUS;
        bool meets_ground = y < 0.0 && to_ground > 0.0;
        float reach = meets_ground ? max(0.0, -r * y - sqrt(max(to_ground, 0.0)))
                                   : -r * y + sqrt(to_ground + AIR_HEIGHT * (2.0 * PLANET_RADIUS + AIR_HEIGHT));
        vec4 through = vec4(1.0);
        float sun_y = mu;
        for (int k = 0; k < STEPS; ++k)
        {
            float s = (float(k) + 0.5) / float(STEPS);
            float t = reach * s * s;
            float dt = reach * 2.0 * s / float(STEPS);
            float at = max(0.0, height_along(h, y, t));
            sun_y = clamp((r * mu + t * (d.y * mu + d.x * sine_sun)) / (PLANET_RADIUS + at), -1.0, 1.0);
            vec4 air = RAYLEIGH * exp(-at / RAYLEIGH_SCALE);
            vec4 haze = aerosol * exp(-at / AEROSOL_SCALE);
            vec4 extinction = air + haze + OZONE * ozone_density(at);
            vec4 scattering = air + haze * AEROSOL_ALBEDO;
            vec4 survived = exp(-extinction * dt);
            vec4 share = through * scattering * (1.0 - survived) / extinction;
            second += share * sun_transmittance(at, sun_y, turbidity) / (4.0 * PI);
            passed_on += share;
            through *= survived;
        }
        vec4 lit_ground = sun_transmittance(0.0, sun_y, turbidity) * max(sun_y, 0.0) * GROUND_ALBEDO / PI;
        second += meets_ground ? through * lit_ground : vec4(0.0);
    }
    float count = float(DIRECTIONS * DIRECTIONS);
    return second / count / (1.0 - passed_on / count);
}

void main()
{
    vec2 place = (gl_FragCoord.xy - 0.5) / (vec2(SKY_MULTIPLE_SIZE) - 1.0);
    float s = 2.0 * place.x - 1.0;
    multiple_scattering = scattered_more(place.y * AIR_HEIGHT, sign(s) * s * s, analytic_sky.turbidity);
}
