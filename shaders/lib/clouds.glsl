// Fair-weather clouds: cumulus with flat bases, and combed cirrus far above. Lengths in kilometres; places on the plane
// are (x, z) from the camera. The shapes are art; their light follows the rules cited.
#include "lib/atmosphere.glsl"
#include "lib/noise.glsl"

const float CUMULUS_BASE = 1.0;
const float CUMULUS_THICKNESS = 0.9;
const float CUMULUS_EXTINCTION = 18.0;    // per km: at the soft end of cumulus humilis, or rims would alias
const float CUMULUS_REACH = 45.0;         // beyond it haze has taken them
const float CIRRUS_HEIGHT = 8.5;
const float CIRRUS_REACH = 160.0;
const float NEAR_STEP = 0.055;            // km, inside clouds
const float STEP_GROWTH = 0.008;          // of the distance
const float COLUMN_STRIDE = 0.7;          // km per unit of cumulus_column, whose slope is nearly always under 1.5 per km
const float TEXEL = 0.002;                // radians that the finest billow must cover
const int LIGHT_STEPS = 4;
const float LIGHT_REACH[LIGHT_STEPS] = float[](0.04, 0.13, 0.32, 0.75);  // km towards the sun: middles of the steps
const float LIGHT_STEP[LIGHT_STEPS] = float[](0.08, 0.12, 0.28, 0.60);

// How far a column is inside a cloud: 0 at its rim, negative outside, 1 and more deep inside. at: km; coverage: 0..1, share
// of the sky, by a logistic fit of the noise's quantiles; octaves: 1..3; seed: any.
float cumulus_column(vec2 at, float coverage, float octaves, uint seed)
{
    vec2 p = at + vec2(13.7, 5.3);  // gradient noise is 0 at its lattice points, and all octaves share the one at 0
    float shape = fbm(p * 0.55, octaves, seed) + 0.4 * gradient_noise(p * 0.09, seed + 17u);
    return (shape - 0.22 * log((1.004 - coverage) / (coverage + 0.001))) / 0.6;
}

// Billows: the absolute value of gradient noise has round heads and creases between them. at: km; octaves: 0..5, its
// fraction fades the last one in; seed: any. Returns -0.5..1.
float billows(vec3 at, float octaves, uint seed)
{
    float sum = 0.0;
    float weight = 0.55;
    vec3 p = at * 2.1 + vec3(3.1, 7.9, 1.7);
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
    // Where the dome alone decides, billows are skipped: a loop of no rounds, because both sides of a branch would run.
    bool is_decided = column <= 0.0 || dome < -0.6 * amplitude || dome > 0.25 + 0.45 * amplitude;
    float billow = billows(vec3(at.x, at.y * CUMULUS_THICKNESS, at.z), is_decided ? 0.0 : octaves, seed);
    return column <= 0.0 ? 0.0 : clamp(3.0 * (dome + amplitude * billow), 0.0, 1.0) * smoothstep(0.0, 0.07, at.y);
}

// Optical depth of cumulus between a point and the sun, in four steps that grow. at: as in cumulus_density; sun: unit, and
// taken to be above the clouds' horizon, because a lower one shines through the neighbours; is_wanted: else 0, at no cost.
float cumulus_shade(vec3 at, vec3 sun, float coverage, uint seed, bool is_wanted)
{
    float depth = 0.0;
    for (int i = 0; i < (is_wanted ? LIGHT_STEPS : 0); ++i)
    {
        float s = LIGHT_REACH[i];
        vec3 there = at + s * vec3(sun.x, max(sun.y, 0.05) / CUMULUS_THICKNESS, sun.z);
        depth += LIGHT_STEP[i] * cumulus_density(there, cumulus_column(there.xz, coverage, 2.0, seed), 1.0, seed);
    }
    return depth * CUMULUS_EXTINCTION;
}

// Phase function of water drops: a strong forward lobe, which draws the silver lining, and a weak backward one (two lobes of
// Henyey & Greenstein 1941). cosine: of the angle of scattering. Per steradian.
float droplet_phase(float cosine)
{
    return 0.75 * henyey_greenstein(cosine, 0.8) + 0.25 * henyey_greenstein(cosine, -0.15);
}

// The same for light scattered many times, which forgets where it came from.
float diffuse_phase(float cosine)
{
    return 0.5 * henyey_greenstein(cosine, 0.5) + 0.5 / (4.0 * PI);
}

// What a ray meets of the cumulus layer. Each is a sum over the ray, so that it fades with the cloud itself.
struct Cumulus
{
    float cover;     // share of the ray's light that it takes, 0..1
    float lit;       // scattered sunlight, per steradian
    float open;      // share that sees the sky round it
    float deep;      // share that sees only cloud
    float distance;  // mean, km; where nothing is met the layer's own
};

// Ray march through the layer. Direct sunlight fades by Beer's law; what was scattered often by exp(-depth / 5) and, deep
// inside, as one over the depth: the two-stream solution of a thick cloud (Bohren 1987, section 3). d, sun: unit; eye: height
// of the camera, km; coverage: 0..1; jitter: 0..1, the start of the first step; seed: any.
Cumulus cumulus_along(vec3 d, vec3 sun, float eye, float coverage, float jitter, uint seed)
{
    float cosine = dot(d, sun);
    float direct = droplet_phase(cosine);
    float diffuse = diffuse_phase(cosine);
    float first = distance_to_height(eye, d.y, CUMULUS_BASE);
    float last = min(distance_to_height(eye, d.y, CUMULUS_BASE + CUMULUS_THICKNESS), CUMULUS_REACH);
    float end = coverage > 0.0 ? last : 0.0;
    float t = first + (NEAR_STEP + STEP_GROWTH * first) * jitter;
    float through = 1.0;
    Cumulus met = Cumulus(0.0, 0.0, 0.0, 0.0, 0.0);
    while (t < end && through > 0.02)
    {
        float dt = NEAR_STEP + STEP_GROWTH * t;
        float column = cumulus_column(d.xz * t, coverage, 3.0, seed);
        float before = column;
        float stride = 0.0;
        // The clear stretch, by strides that hardly ever jump over a cloud: an inner loop, because a branch saves nothing.
        while (column <= 0.0 && t < end)
        {
            before = column;
            stride = max(dt, -COLUMN_STRIDE * column);
            t += stride;
            column = cumulus_column(d.xz * t, coverage, 3.0, seed);
        }
        // Back to the rim, then on by the jitter: strides of like lengths would draw terraces.
        float inside = stride > 0.0 ? min(stride * column / max(column - before, 1e-4), stride) : 0.0;
        t -= stride > 0.0 ? max(inside - jitter * dt, 0.0) : 0.0;
        vec3 at = vec3(d.x * t, (height_along(eye, d.y, t) - CUMULUS_BASE) / CUMULUS_THICKNESS, d.z * t);
        float density = cumulus_density(at, column, clamp(log2(0.5 / (t * TEXEL)), 1.0, 5.0), seed);
        float depth = cumulus_shade(at, sun, coverage, seed, density > 0.0);
        float share = through * (1.0 - exp(-density * CUMULUS_EXTINCTION * dt));
        float shallow = 1.0 / (1.0 + 0.45 * max(column - 0.4, 0.0));  // thick columns have dark bases
        met.lit += share * (direct * exp(-depth) + 0.5 * diffuse * (exp(-0.2 * depth) + 1.0 / (1.0 + 0.2 * depth)));
        met.open += share * shallow * (0.3 + 0.7 * clamp(at.y, 0.0, 1.0));
        met.deep += share * shallow;
        met.distance += share * t;
        through -= share;
        t += density > 0.0 ? dt : 0.75 * dt;
    }
    met.cover = 1.0 - through;
    float fade = 1.0 - smoothstep(0.5 * CUMULUS_REACH, CUMULUS_REACH, met.distance / max(met.cover, 1e-4));
    met.distance += through * first;
    return Cumulus(met.cover * fade, met.lit * fade, met.open * fade, met.deep * fade, met.distance);
}

// Optical depth of cirrus: ice combed by the wind, in patches. at: (x, z), km; coverage: 0..1; seed: any. Returns 0..0.6.
float cirrus_depth(vec2 at, float coverage, uint seed)
{
    vec2 comb = vec2(dot(at, vec2(0.92, 0.39)), dot(at, vec2(-0.39, 0.92))) + vec2(41.3, 17.9);
    vec2 warp = vec2(fbm(comb * 0.06, 2.0, seed + 61u), fbm(comb * 0.06 + 7.3, 2.0, seed + 71u));
    float strands = fbm(vec2(comb.x * 0.05, comb.y * 0.17) + 1.2 * warp, 5.0, seed + 83u);
    float patches = gradient_noise(comb * 0.025 + 3.1, seed + 97u);
    float cover = clamp(0.6 * strands + 0.7 * patches + min(3.0 * coverage, 0.75) - 0.6, 0.0, 1.0);
    return coverage > 0.0 ? 0.6 * cover * cover * (3.0 - 2.0 * cover) : 0.0;
}
