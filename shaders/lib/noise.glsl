// Hashes and lattice noise. Integer arithmetic decides every lattice value, so the same point has the same
// noise on every driver. Nothing here repeats within 2^32 lattice cells.

// Jarzynski & Olano 2020, section 3 (PCG output permutation). x: any 32 bits. Returns 32 well mixed bits.
uint hash_uint(uint x)
{
    uint state = x * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// Lattice cell to 32 bits: primes of Teschner et al. 2003, section 4.1, then the mixer of Wellons 2018, because
// the bare xor leaves diagonal lines. p: cell; seed: any.
uint hash_cell(ivec3 p, uint seed)
{
    uvec3 q = uvec3(p) * uvec3(73856093u, 19349663u, 83492791u);
    uint h = (q.x ^ q.y ^ q.z) + seed * 2654435769u;
    h = (h ^ (h >> 16u)) * 0x7feb352du;
    return (h ^ (h >> 15u)) * 0x846ca68bu;
}

// The same for a plane's cell.
uint hash_cell(ivec2 p, uint seed)
{
    return hash_cell(ivec3(p, 0), seed);
}

// The top 24 bits of h as a number in 0..1, 1 excluded; exact in 32-bit floats.
float unit_float(uint h)
{
    return float(h >> 8u) * (1.0 / 16777216.0);
}

// Perlin 2002: weights whose first and second derivatives vanish at both ends. f: place in the cell, 0..1.
vec2 quintic(vec2 f)
{
    return f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
}

// The same for space.
vec3 quintic(vec3 f)
{
    return f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
}

// Value noise: lattice values in 0..1, quintic weights. p: in cells; seed: any. Returns 0..1, mean 0.5.
float value_noise(vec2 p, uint seed)
{
    ivec2 cell = ivec2(floor(p));
    vec2 w = quintic(p - floor(p));
    float a = unit_float(hash_cell(cell, seed));
    float b = unit_float(hash_cell(cell + ivec2(1, 0), seed));
    float c = unit_float(hash_cell(cell + ivec2(0, 1), seed));
    float d = unit_float(hash_cell(cell + ivec2(1, 1), seed));
    return mix(mix(a, b, w.x), mix(c, d, w.x), w.y);
}

// Perlin 2002: one of eight gradients (four diagonals, four axes times sqrt 2) by three bits of h, dotted with f.
float gradient_dot(uint h, vec2 f)
{
    bool is_axis = (h & 0x80000000u) != 0u;
    float a = (h & 0x40000000u) != 0u ? f.x : f.y;
    float b = (h & 0x40000000u) != 0u ? f.y : f.x;
    a = (h & 0x20000000u) != 0u ? -a : a;
    b = (h & 0x10000000u) != 0u ? -b : b;
    return is_axis ? 1.41421356 * a : a + b;
}

// Perlin 2002, table of twelve edge directions (four of them twice) by four bits of h, dotted with f.
float gradient_dot(uint h, vec3 f)
{
    uint pair = h >> 30u;
    float u = pair == 2u ? f.y : f.x;
    float v = pair == 0u || pair == 3u ? f.y : f.z;
    u = (h & 0x20000000u) != 0u ? -u : u;
    v = (h & 0x10000000u) != 0u ? -v : v;
    return u + v;
}

// Gradient noise of the plane (Perlin 2002). p: in cells; seed: any. Returns about -1..1, mean 0.
float gradient_noise(vec2 p, uint seed)
{
    ivec2 cell = ivec2(floor(p));
    vec2 f = p - floor(p);
    vec2 w = quintic(f);
    float a = gradient_dot(hash_cell(cell, seed), f);
    float b = gradient_dot(hash_cell(cell + ivec2(1, 0), seed), f - vec2(1.0, 0.0));
    float c = gradient_dot(hash_cell(cell + ivec2(0, 1), seed), f - vec2(0.0, 1.0));
    float d = gradient_dot(hash_cell(cell + ivec2(1, 1), seed), f - vec2(1.0, 1.0));
    return mix(mix(a, b, w.x), mix(c, d, w.x), w.y);
}

// Gradient noise of space (Perlin 2002). p: in cells; seed: any. Returns about -1..1, mean 0.
float gradient_noise(vec3 p, uint seed)
{
    ivec3 cell = ivec3(floor(p));
    vec3 f = p - floor(p);
    vec3 w = quintic(f);
    vec2 e = vec2(0.0, 1.0);
    ivec2 i = ivec2(0, 1);
    float a = gradient_dot(hash_cell(cell, seed), f);
    float b = gradient_dot(hash_cell(cell + i.yxx, seed), f - e.yxx);
    float c = gradient_dot(hash_cell(cell + i.xyx, seed), f - e.xyx);
    float d = gradient_dot(hash_cell(cell + i.yyx, seed), f - e.yyx);
    float k = gradient_dot(hash_cell(cell + i.xxy, seed), f - e.xxy);
    float l = gradient_dot(hash_cell(cell + i.yxy, seed), f - e.yxy);
    float m = gradient_dot(hash_cell(cell + i.xyy, seed), f - e.xyy);
    float n = gradient_dot(hash_cell(cell + i.yyy, seed), f - e.yyy);
    vec4 near_far = mix(vec4(a, c, k, m), vec4(b, d, l, n), w.x);
    vec2 layers = mix(near_far.xz, near_far.yw, w.y);
    return mix(layers.x, layers.y, w.z);
}

// Twice as fine, turned by angles of 3-4-5 triangles: exact in floats, and no two octaves' lattices line up.
const mat2 NOISE_TURN_PLANE = mat2(1.6, -1.2, 1.2, 1.6);
const mat3 NOISE_TURN = mat3(1.6, -0.96, 0.72, 1.2, 1.28, -0.96, 0.0, 1.2, 1.6);

// Fractional Brownian motion (Musgrave 2003, section 16.3): octaves of gradient noise, each twice as fine and half as
// strong. p: in cells of the first octave; octaves: 1..12, its
// fraction fades the last one in; seed: any. Returns about -1..1, mean 0.
float fbm(vec2 p, float octaves, uint seed)
{
    float sum = 0.0;
    float weight = 1.0;
    for (uint i = 0u; float(i) < octaves; ++i)
    {
        sum += weight * min(octaves - float(i), 1.0) * gradient_noise(p, seed + i);
        p = NOISE_TURN_PLANE * p;
        weight *= 0.5;
    }
    return sum;
}

// The same in space.
float fbm(vec3 p, float octaves, uint seed)
{
    float sum = 0.0;
    float weight = 1.0;
    for (uint i = 0u; float(i) < octaves; ++i)
    {
        sum += weight * min(octaves - float(i), 1.0) * gradient_noise(p, seed + i);
        p = NOISE_TURN * p;
        weight *= 0.5;
    }
    return sum;
}
