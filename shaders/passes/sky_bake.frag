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

const float DECK_GLOW = 0.065;  // per steradian: what a closed deck lets through of the sun

// What reaches a cloud, for sunlight of 1 outside the air, and what of it reaches the eye.
struct CloudLight
{
    vec3 sun;      // sunlight on it
    vec3 around;   // light from all sides
    vec3 through;  // share of its own light that the air lets through
    vec4 front;    // share of the clear sky's light that comes from the air in front of it
};

// Light of one block of the scattering table. d: unit.
vec4 scattered(vec3 d, int block)
{
    vec2 at = texel_place(scattering_place(d, sky_light.sun_direction), vec2(SKY_SCATTERING_COLUMNS, SKY_SCATTERING_ROWS));
    return textureLod(scattering_map, vec2(at.x, (at.y + float(block)) / 3.0), 0.0);
}

// d: unit; reach: distance to the cloud, km; beyond: optical depth of the whole clear sky along d. The air in front of a
// cloud is taken to shine as the whole clear sky does, by its share of the opacity.
CloudLight cloud_light(vec3 d, float reach, vec4 beyond)
{
    vec3 sun = sky_light.sun_direction;
    float turbidity = analytic_sky.turbidity;
    float r = PLANET_RADIUS + SKY_EYE_HEIGHT;
    float h = height_along(SKY_EYE_HEIGHT, d.y, reach);
    float sun_mu = clamp((r * sun.y + reach * dot(d, sun)) / (PLANET_RADIUS + h), -1.0, 1.0);
    float view_mu = clamp((r * d.y + reach) / (PLANET_RADIUS + h), -1.0, 1.0);
    vec4 near = exp(-max(beyond - optical_depth(h, view_mu, turbidity), 0.0));
    vec2 place = texel_place(multiple_place(h, sun_mu), vec2(SKY_MULTIPLE_SIZE));
    return CloudLight(
        color_from_spectrum(sun_transmittance(h, sun_mu, turbidity)),
        color_from_spectrum(textureLod(multiple_map, place, 0.0)),
        color_from_spectrum(near),
        (1.0 - near) / (1.0 - exp(-beyond)));
}

void main()
{
    vec3 d = sky_direction(gl_FragCoord.xy / float(SKY_TABLE_SIZE));
    vec3 sun = sky_light.sun_direction;
    float coverage = analytic_sky.clouds;
    uint seed = hash_uint(uint(sky_light.seed));
    float cosine = dot(d, sun);
    vec4 air = rayleigh_phase(cosine) * scattered(d, 0) + scattered(d, 2);
    vec4 haze = aerosol_phase(cosine) * scattered(d, 1);
    vec4 beyond = optical_depth(SKY_EYE_HEIGHT, d.y, analytic_sky.turbidity);

    float deck = smoothstep(0.5, 1.0, coverage);
    // Steps that all began alike would show as terraces; a texel's own start turns them into down. Near ones are too short to.
    float near = clamp(distance_to_height(SKY_EYE_HEIGHT, d.y, CUMULUS_BASE) / 4.0, 0.0, 1.0);
    float jitter = (0.8 - 0.5 * deck) * near * unit_float(hash_cell(ivec2(gl_FragCoord.xy), seed));
    Cumulus cumulus = cumulus_along(d, sun, SKY_EYE_HEIGHT, coverage, jitter, seed);
    CloudLight low = cloud_light(d, cumulus.distance, beyond);
    float reach = distance_to_height(SKY_EYE_HEIGHT, d.y, CIRRUS_HEIGHT);
    CloudLight high = cloud_light(d, reach, beyond);
    float ice = cirrus_depth(d.xz * reach, coverage, seed) * (1.0 - smoothstep(0.3 * CIRRUS_REACH, CIRRUS_REACH, reach));
    float veil = 1.0 - exp(-ice);

    // Where clouds close to a deck, its underside and the air below are lit by what the deck lets through, nearly grey.
    float is_far = smoothstep(0.2 * CUMULUS_REACH, CUMULUS_REACH, distance_to_height(SKY_EYE_HEIGHT, d.y, CUMULUS_BASE));
    float gap = (1.0 - cumulus.cover) * (1.0 - deck * is_far);
    vec3 deck_light = sky_light.sunlight * low.sun * DECK_GLOW * (0.2 + 0.8 * max(sun.y, 0.0))
        + sky_light.airlight * 0.3 * low.around;
    deck_light = mix(vec3(dot(deck_light, LUMINANCE)), deck_light, 0.35);

    vec3 cumulus_light = sky_light.sunlight * low.sun * cumulus.lit * (1.0 - 0.8 * deck)
        + sky_light.airlight * low.around * cumulus.open * (1.0 - 0.6 * deck) + deck * deck_light * cumulus.deep;
    vec3 cirrus_light = veil * (0.75 * sky_light.sunlight * high.sun * (henyey_greenstein(cosine, 0.75) + diffuse_phase(cosine))
        + 0.6 * sky_light.airlight * high.around);
    vec4 clear = low.front * (1.0 - deck) + (1.0 - low.front) * gap * (1.0 - veil + veil * high.front);
    vec3 dome = sky_light.dome * overcast_shape(d.y) * (1.0 - 0.5 * (cumulus.cover - cumulus.open) * low.through);

    vec3 light = sky_light.airlight * color_from_spectrum(air * clear) + sky_light.sunlight * color_from_spectrum(haze * clear)
        + deck * color_from_spectrum(low.front) * deck_light + low.through * cumulus_light + gap * high.through * cirrus_light + dome;
    sky = vec4(light, gap * (1.0 - veil));
}
