// Fair-weather clouds: a layer of cumulus with flat bases, and thin cirrus far above. Lengths in kilometres; places are
// (x, z) from the camera. Shapes are art, lit by the rules cited.
#include "lib/noise.glsl"

const float CUMULUS_BASE = 1.0;
const float CUMULUS_THICKNESS = 0.9;
const float CUMULUS_EXTINCTION = 18.0;   // per kilometre: soft cumulus humilis
const float CIRRUS_HEIGHT = 8.5;
const float CIRRUS_REACH = 160.0;
const float CLOUD_REACH = 45.0;          // beyond it haze has taken them

// How far a column is inside a cloud: 0 at its rim, negative outside, 1 and more deep inside. at: km; coverage: 0..1, share
// of the sky, by the logistic fit of the noise's quantiles; octaves: 1..3; seed: any.
float cumulus_column(vec2 at, float coverage, float octaves, uint seed)
{
    float shape = fbm(at * 0.55, octaves, seed) + 0.4 * gradient_noise(at * 0.09, seed + 17u);
    float threshold = 0.22 * log((1.004 - coverage) / (coverage + 0.001));
    return (shape - threshold) / 0.6;
}

// Billows: the absolute value of gradient noise has round heads and creases between them. at: km; octaves: 0..5, its
// fraction fades the last one in; seed: any. Returns -0.5..1.
float billows(vec3 at, float octaves, uint seed)
{
    float sum = 0.0;
    float weight = 0.55;
    vec3 p = at * 2.1;
    for (uint i = 0u; float(i) < octaves; ++i)
    {
        sum += weight * min(octaves - float(i), 1.0) * (abs(gradient_noise(p, seed + 31u + i)) - 0.25);
        p = NOISE_TURN * p;
        weight *= 0.55;
    }
    return sum;
}

// Density of cumulus, 0..1: a flat base, a dome as high as the column is deep, billows all over. at: (x, z) in km, and in y
// the height over the base as a share of the thickness; column: from cumulus_column; octaves: of billows, 0..5; seed: any.
float cumulus_density(vec3 at, float column, float octaves, uint seed)
{
    float inside = clamp(column, 0.0, 1.0);
    float dome = min(sqrt(inside) * (0.55 + 0.45 * inside) - at.y, 3.0 * inside);
    float amplitude = 0.55 + 0.6 * at.y;
    // Where the dome alone decides, billows are skipped; a loop of no rounds, because both sides of a branch would run.
    bool decided = column <= 0.0 || dome < -0.6 * amplitude || dome > 0.25 + 0.45 * amplitude;
    float billow = billows(vec3(at.x, at.y * CUMULUS_THICKNESS, at.z), decided ? 0.0 : octaves, seed);
    return column <= 0.0 ? 0.0 : clamp(4.0 * (dome + amplitude * billow), 0.0, 1.0) * smoothstep(0.0, 0.07, at.y);
}

// Optical depth of cirrus: ice combed by the wind, in patches. at: (x, z), km; coverage: 0..1; seed: any. Returns 0..0.6.
float cirrus_depth(vec2 at, float coverage, uint seed)
{
    vec2 comb = vec2(dot(at, vec2(0.92, 0.39)), dot(at, vec2(-0.39, 0.92)));
    vec2 warp = vec2(fbm(comb * 0.06, 2.0, seed + 61u), fbm(comb * 0.06 + 7.3, 2.0, seed + 71u));
    float strands = fbm(vec2(comb.x * 0.05, comb.y * 0.17) + 1.2 * warp, 5.0, seed + 83u);
    float patches = gradient_noise(comb * 0.025 + 3.1, seed + 97u);
    float cover = clamp(0.6 * strands + 0.7 * patches + min(3.0 * coverage, 0.75) - 0.6, 0.0, 1.0);
    return 0.6 * cover * cover * (3.0 - 2.0 * cover);
}
