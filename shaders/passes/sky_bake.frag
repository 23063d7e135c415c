// Last step of the sky: its radiance by direction, and in alpha how much of the sun's disc shows through.
#include <AnalyticSky>
#include <SkyLight>
#include "lib/atmosphere.glsl"
#include "lib/clouds.glsl"
#include "lib/noise.glsl"
#include "lib/sky.glsl"

uniform sampler2D multiple_map;
uniform sampler2D scattering_map;

layout(location = 0) out vec4 sky;

const float DECK_GLOW = 0.05;   // per steradian
const float NEAR_STEP = 0.05;     // km, inside clouds
const float STEP_GROWTH = 0.007;  // of the distance
const float COLUMN_STRIDE = 0.7;  // km per unit of cumulus_column, whose slope is under 1.6 per km nearly everywhere
const int LIGHT_STEPS = 4;
const float LIGHT_REACH[LIGHT_STEPS] = float[](0.04, 0.13, 0.32, 0.75);
const float LIGHT_STEP[LIGHT_STEPS] = float[](0.08, 0.12, 0.28, 0.6);

vec4 scattering_block(vec2 place, int block)
{
    vec2 size = vec2(SKY_SCATTERING_COLUMNS, SKY_SCATTERING_ROWS);
    vec2 at = texel_place(place, size);
    at.y = (at.y + float(block)) / 3.0;
    return textureLod(scattering_map, at, 0.0);
}

// What reaches a cloud, and what of it reaches the eye.
struct CloudLight
{
    vec3 sun;      // sunlight on it, for sunlight of 1 outside the air
    vec3 around;   // light from all sides, the same
    vec3 through;  // share of its own light that the air lets through
    vec4 front;    // share of the clear sky's light that comes from the air in front of it
};

// d: unit direction; reach: distance to the cloud, km; beyond: optical depth of the whole clear sky along d.
CloudLight cloud_light(vec3 d, float reach, vec4 beyond)
{
    float r = PLANET_RADIUS + SKY_EYE_HEIGHT;
    float h = height_along(SKY_EYE_HEIGHT, d.y, reach);
    float sun_mu = clamp((r * sky_light.sun_direction.y + reach * dot(d, sky_light.sun_direction)) / (PLANET_RADIUS + h), -1.0, 1.0);
    float view_mu = clamp((r * d.y + reach) / (PLANET_RADIUS + h), -1.0, 1.0);
    vec4 near = exp(-max(beyond - optical_depth(h, view_mu, analytic_sky.turbidity), 0.0));
    vec2 place = texel_place(multiple_place(h, sun_mu), vec2(SKY_MULTIPLE_SIZE));
    return CloudLight(color_from_spectrum(sun_transmittance(h, sun_mu, analytic_sky.turbidity)),
        color_from_spectrum(textureLod(multiple_map, place, 0.0)), color_from_spectrum(near), (1.0 - near) / (1.0 - exp(-beyond)));
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
    vec4 air = rayleigh_phase(cosine) * scattering_block(place, 0) + scattering_block(place, 2);
    vec4 haze = aerosol_phase(cosine) * scattering_block(place, 1);

    vec4 beyond = optical_depth(SKY_EYE_HEIGHT, d.y, turbidity);
    float first = distance_to_height(SKY_EYE_HEIGHT, d.y, CUMULUS_BASE);
    float last = min(distance_to_height(SKY_EYE_HEIGHT, d.y, CUMULUS_BASE + CUMULUS_THICKNESS), CLOUD_REACH);
    float through = 1.0;
    float lit = 0.0;
    float ambient = 0.0;
    float far = 0.0;
    float glimmer = 0.0;
    float forward = 0.75 * henyey_greenstein(cosine, 0.8) + 0.25 * henyey_greenstein(cosine, -0.15);
    float glow = 0.5 * henyey_greenstein(cosine, 0.5) + 0.5 / (4.0 * PI);
    float deck = smoothstep(0.5, 1.0, coverage);
    float t = first + (NEAR_STEP + STEP_GROWTH * first) * unit_float(hash_cell(ivec2(gl_FragCoord.xy), seed));
    float end = coverage > 0.0 ? last : 0.0;
    while (t < end && through > 0.02)
    {
        // Loops and no branches: a software rasteriser runs both sides of a branch, but leaves a loop.
        float dt = NEAR_STEP + STEP_GROWTH * t;
        float column = cumulus_column(d.xz * t, coverage, 3.0, seed);
        while (column <= 0.0 && t < end)
        {
            t += max(dt, -COLUMN_STRIDE * column);
            column = cumulus_column(d.xz * t, coverage, 3.0, seed);
        }
        vec2 at = d.xz * t;
        float y = (height_along(SKY_EYE_HEIGHT, d.y, t) - CUMULUS_BASE) / CUMULUS_THICKNESS;
        float octaves = clamp(log2(0.5 / (t * 0.002)), 1.0, 5.0);
        float density = cumulus_density(vec3(at.x, y, at.y), column, octaves, seed);
        float depth = 0.0;
        for (int k = 0; k < (density > 0.0 ? LIGHT_STEPS : 0); ++k)
        {
            float s = LIGHT_REACH[k];
            vec2 there = at + to_sun.xz * s;
            float up = y + max(to_sun.y, 0.05) * s / CUMULUS_THICKNESS;
            depth += LIGHT_STEP[k] * cumulus_density(vec3(there.x, up, there.y), cumulus_column(there, coverage, 2.0, seed), 1.0, seed);
        }
        depth *= CUMULUS_EXTINCTION;
        float deep = 1.0 / (1.0 + 0.45 * max(column - 0.4, 0.0));
        float source = forward * exp(-depth) + glow * (0.5 * exp(-0.2 * depth) + 0.5 / (1.0 + 0.2 * depth));
        float alpha = 1.0 - exp(-density * CUMULUS_EXTINCTION * dt);
        lit += through * alpha * source;
        ambient += through * alpha * deep * (0.3 + 0.7 * clamp(y, 0.0, 1.0));
        glimmer += through * alpha * deck * deep;
        far += through * alpha * t;
        through *= 1.0 - alpha;
        t += dt;
    }
    float cover = 1.0 - through;
    float fade = 1.0 - smoothstep(0.5 * CLOUD_REACH, CLOUD_REACH, far / max(cover, 1e-4));
    CloudLight low = cloud_light(d, far + through * first, beyond);
    vec3 deck_light = sky_light.sunlight * (DECK_GLOW * (0.2 + 0.8 * max(sky_light.sun_direction.y, 0.0))
        * mix(vec3(dot(low.sun, LUMINANCE)), low.sun, 0.4)) + sky_light.airlight * low.around * 0.3;
    vec3 cumulus = sky_light.sunlight * low.sun * lit + sky_light.airlight * low.around * ambient + deck_light * glimmer;

    float reach = distance_to_height(SKY_EYE_HEIGHT, d.y, CIRRUS_HEIGHT);
    CloudLight high = cloud_light(d, reach, beyond);
    float thickness = cirrus_depth(d.xz * reach, coverage, seed) * (1.0 - smoothstep(0.3, 1.0, reach / CIRRUS_REACH));
    float veil = 1.0 - exp(-thickness);
    vec3 cirrus = veil * (sky_light.sunlight * high.sun * (0.5 * henyey_greenstein(cosine, 0.75) + 0.5 * glow) * 1.5
        + sky_light.airlight * high.around * 0.6);

    cover *= fade;
    float gap = (1.0 - cover) * (1.0 - deck * smoothstep(0.2 * CLOUD_REACH, CLOUD_REACH, first));
    // Air in front of a closed deck is lit by the deck.
    vec4 behind = (1.0 - low.front) * gap * (1.0 - veil + veil * high.front);
    vec4 seen = low.front * (1.0 - deck) + behind;
    sky = vec4(sky_light.airlight * color_from_spectrum(air * seen) + sky_light.sunlight * color_from_spectrum(haze * seen)
        + deck * color_from_spectrum(low.front) * deck_light
        + low.through * cumulus * fade + gap * high.through * cirrus, gap * (1.0 - veil));
}
