// Fair-weather clouds: a layer of cumulus with flat bases, and thin cirrus far above. Lengths in kilometres; places are
// (x, z) from the camera. Shapes are art, lit by the rules cited.
#include "lib/noise.glsl"

const float CUMULUS_BASE = 1.0;
const float CUMULUS_THICKNESS = 0.9;
const float CUMULUS_EXTINCTION = 18.0;   // per kilometre: soft cumulus humilis
const float CIRRUS_HEIGHT = 8.5;
const float CLOUD_REACH = 45.0;          // beyond it haze has taken them

// How far a column is inside a cloud: 0 at its rim, negative outside, up to 1 deep inside. at: km; coverage: 0..1, share
// of the sky; seed: any.
float cumulus_column(vec2 at, float coverage, uint seed)
{
    float shape = fbm(at * 0.55, 3.0, seed) + 0.4 * gradient_noise(at * 0.09, seed + 17u);
    float threshold = mix(0.75, -0.95, pow(coverage, 0.8));
    return min((shape - threshold) / 0.6, 1.0);
}

// Billowing detail: ridged sums have creases outside and rounded heads inside when added. at: km; octaves: 0..5.
float billows(vec3 at, float octaves, uint seed)
{
    float sum = 0.0;
    float weight = 0.55;
    vec3 p = at * 2.1;
    for (uint i = 0u; float(i) < octaves; ++i)
    {
        sum += weight * min(octaves - float(i), 1.0) * (abs(gradient_noise(p, seed + 31u + i)) - 0.25);
        p = mat3(1.6, -0.96, 0.72, 1.2, 1.28, -0.96, 0.0, 1.2, 1.6) * p;
        weight *= 0.55;
    }
    return sum;
}

// Density of cumulus, 0..1. at: (x, z) and height over the base as a share of the thickness in y.
float cumulus_density(vec3 at, float column, float octaves, uint seed)
{
    column = max(column, 0.0);
    float top = sqrt(column) * (0.55 + 0.45 * column);
    float s = min(top - at.y, 2.5 * column);
    vec3 p = vec3(at.x, at.y * CUMULUS_THICKNESS, at.z);
    s += (0.35 + 0.65 * at.y) * billows(p, octaves, seed);
    return clamp(s * 4.0, 0.0, 1.0) * smoothstep(0.0, 0.07, at.y);
}

// Cirrus: optical depth of combed ice clouds. at: km; amount: 0..1.
float cirrus_depth(vec2 at, float amount, uint seed)
{
    vec2 comb = vec2(dot(at, vec2(0.92, 0.39)), dot(at, vec2(-0.39, 0.92)));
    vec2 warp = vec2(fbm(comb * 0.05, 3.0, seed + 61u), fbm(comb * 0.05 + 7.3, 3.0, seed + 71u));
    float strands = fbm(vec2(comb.x * 0.045, comb.y * 0.16) + 1.4 * warp, 6.0, seed + 83u);
    float patches = fbm(comb * 0.03 + 3.1, 2.0, seed + 97u);
    float cover = clamp(0.55 * strands + 0.5 * patches + amount - 0.45, 0.0, 1.0);
    return 0.8 * cover * cover;
}
