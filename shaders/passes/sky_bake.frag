// Last step of the sky: its radiance by direction, and in alpha how much of the sun's disc shows through.
#include <AnalyticSky>
#include <SkyLight>
#include "lib/atmosphere.glsl"
#include "lib/clouds.glsl"
#include "lib/sky.glsl"

uniform sampler2D multiple_map;
uniform sampler2D scattering_map;

layout(location = 0) out vec4 sky;

const int STEPS = 40;

vec4 scattering_block(vec2 place, int block)
{
    vec2 size = vec2(SKY_SCATTERING_COLUMNS, SKY_SCATTERING_ROWS);
    vec2 at = texel_place(place, size);
    at.y = (at.y + float(block)) / 3.0;
    return textureLod(scattering_map, at, 0.0);
}

void main()
{
    vec3 d = sky_direction(gl_FragCoord.xy / float(SKY_TABLE_SIZE));
    vec3 to_sun = sky_light.sun_direction;
    float turbidity = analytic_sky.turbidity;
    float coverage = analytic_sky.clouds;
    uint seed = uint(sky_light.seed) * 7919u;
    float cosine = dot(d, to_sun);
    vec2 place = scattering_place(d, to_sun);
    vec4 clear = rayleigh_phase(cosine) * scattering_block(place, 0) + aerosol_phase(cosine) * scattering_block(place, 1)
        + scattering_block(place, 2);

    float r = PLANET_RADIUS + SKY_EYE_HEIGHT;
    vec4 beyond = optical_depth(SKY_EYE_HEIGHT, d.y, turbidity);
    float first = distance_to_height(SKY_EYE_HEIGHT, d.y, CUMULUS_BASE);
    float last = min(distance_to_height(SKY_EYE_HEIGHT, d.y, CUMULUS_BASE + CUMULUS_THICKNESS), CLOUD_REACH);
    float dt = (last - first) / float(STEPS);
    float through = 1.0;
    float lit = 0.0;
    float ambient = 0.0;
    float far = 0.0;
    float forward = 0.75 * henyey_greenstein(cosine, 0.8) + 0.25 * henyey_greenstein(cosine, -0.15);
    float glow = 0.5 * henyey_greenstein(cosine, 0.5) + 0.5 / (4.0 * PI);
    float t = first + 0.5 * dt;
    float end = coverage > 0.0 ? last : 0.0;
    while (t < end && through > 0.01)
    {
        // A loop and no branch: a software rasteriser runs both sides of a branch, and leaves a loop.
        float column = cumulus_column(d.xz * t, coverage, seed);
        while (column <= 0.0 && t < end)
        {
            t += dt * max(1.0, -6.0 * column);
            column = cumulus_column(d.xz * t, coverage, seed);
        }
        vec2 at = d.xz * t;
        float y = (height_along(SKY_EYE_HEIGHT, d.y, t) - CUMULUS_BASE) / CUMULUS_THICKNESS;
        float octaves = clamp(log2(0.5 / (t * 0.002)), 1.0, 5.0);
        float density = cumulus_density(vec3(at.x, y, at.y), column, column > 0.0 ? octaves : 0.0, seed);
        float depth = 0.0;
        float step_length = 0.08;
        float s = 0.0;
        for (int k = 0; k < (density > 0.0 ? 4 : 0); ++k)
        {
            s += step_length;
            vec2 there = at + to_sun.xz * (s - 0.5 * step_length);
            float up = y + max(to_sun.y, 0.05) * (s - 0.5 * step_length) / CUMULUS_THICKNESS;
            depth += step_length * cumulus_density(vec3(there.x, up, there.y), cumulus_column(there, coverage, seed), 2.0, seed);
            step_length *= 2.0;
        }
        depth *= CUMULUS_EXTINCTION;
        float source = forward * exp(-depth) + glow * (0.5 * exp(-0.2 * depth) + 0.5 / (1.0 + 0.2 * depth));
        float alpha = 1.0 - exp(-density * CUMULUS_EXTINCTION * dt);
        lit += through * alpha * source;
        ambient += through * alpha * (0.45 + 0.75 * clamp(y, 0.0, 1.0));
        far += through * alpha * t;
        through *= 1.0 - alpha;
        t += dt;
    }
    float cover = 1.0 - through;
    float cloud_distance = cover > 0.0 ? far / cover : CLOUD_REACH;
    float h = height_along(SKY_EYE_HEIGHT, d.y, cloud_distance);
    float sun_mu = clamp((r * to_sun.y + cloud_distance * cosine) / (PLANET_RADIUS + h), -1.0, 1.0);
    vec3 sun = color_from_spectrum(sun_transmittance(h, sun_mu, turbidity));
    vec3 around = color_from_spectrum(textureLod(multiple_map, texel_place(multiple_place(h, sun_mu), vec2(SKY_MULTIPLE_SIZE)), 0.0));
    float view_mu = clamp((r * d.y + cloud_distance) / (PLANET_RADIUS + h), -1.0, 1.0);
    vec4 near = max(beyond - optical_depth(h, view_mu, turbidity), 0.0);
    vec4 front = (1.0 - exp(-near)) / (1.0 - exp(-beyond));
    float fade = 1.0 - smoothstep(0.5 * CLOUD_REACH, CLOUD_REACH, cloud_distance);
    cover *= fade;

    vec3 cloud = (sky_light.cloud_sun * sun * lit + sky_light.solar * around * ambient) * fade;
    vec3 air = sky_light.solar * color_from_spectrum(clear * (front * cover + 1.0 - cover));
    sky = vec4(air + color_from_spectrum(exp(-near)) * cloud, 1.0 - cover);
}
