// Second step of the sky: light that clear air sends along each direction, for sunlight of irradiance 1. Three blocks of
// rows: air scattering once, aerosol scattering once (both without their phase functions, which are too sharp for a
// small table), and all that scatters more often.
#include <AnalyticSky>
#include <SkyLight>
#include "lib/atmosphere.glsl"
#include "lib/sky.glsl"

uniform sampler2D multiple_map;

layout(location = 0) out vec4 scattering;

const int STEPS = 48;

void main()
{
    ivec2 texel = ivec2(gl_FragCoord.xy);
    int block = texel.y / SKY_SCATTERING_ROWS;
    texel.y -= block * SKY_SCATTERING_ROWS;
    vec2 to = scattering_direction(vec2(texel) / (vec2(SKY_SCATTERING_COLUMNS, SKY_SCATTERING_ROWS) - 1.0));
    float mu = to.x;
    float along_sun = sqrt(1.0 - mu * mu) * cos(to.y);
    float sun_mu = sky_light.sun_direction.y;
    float sun_sine = sqrt(max(0.0, 1.0 - sun_mu * sun_mu));
    vec4 aerosol = aerosol_extinction(analytic_sky.turbidity);
    float reach = distance_to_height(SKY_EYE_HEIGHT, mu, AIR_HEIGHT);
    float r = PLANET_RADIUS + SKY_EYE_HEIGHT;
    vec4 through = vec4(1.0);
    vec4 sum = vec4(0.0);
    for (int k = 0; k < STEPS; ++k)
    {
        // Steps grow with distance: most of the air and nearly all aerosol is near.
        float s = (float(k) + 0.5) / float(STEPS);
        float t = reach * s * s;
        float dt = reach * 2.0 * s / float(STEPS);
        float h = height_along(SKY_EYE_HEIGHT, mu, t);
        float sun_y = clamp((r * sun_mu + t * (mu * sun_mu + along_sun * sun_sine)) / (PLANET_RADIUS + h), -1.0, 1.0);
        vec4 air = RAYLEIGH * exp(-h / RAYLEIGH_SCALE);
        vec4 haze = aerosol * exp(-h / AEROSOL_SCALE);
        vec4 extinction = air + haze + OZONE * ozone_density(h);
        vec4 survived = exp(-extinction * dt);
        vec4 share = through * (1.0 - survived) / extinction;
        vec4 sun = sun_transmittance(h, sun_y, analytic_sky.turbidity);
        vec4 more = textureLod(multiple_map, texel_place(multiple_place(h, sun_y), vec2(SKY_MULTIPLE_SIZE)), 0.0);
        vec4 once_air = air * sun;
        vec4 once_haze = haze * AEROSOL_ALBEDO * sun;
        vec4 often = (air + haze * AEROSOL_ALBEDO) * more;
        sum += share * (block == 0 ? once_air : block == 1 ? once_haze : often);
        through *= survived;
    }
    scattering = sum;
}
