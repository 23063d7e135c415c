// Encodings of colour. Linear RGB, primaries of sRGB.

// Textures store the root of the linear value: squaring is exact on every driver.
vec3 linear_from_root(vec3 root)
{
    return root * root;
}

// IEC 61966-2-1, section 5.2. linear: 0..1. The threshold keeps the base of the power away from zero.
vec3 srgb_from_linear(vec3 linear)
{
    vec3 curved = 1.055 * pow(max(linear, vec3(0.0031308)), vec3(1.0 / 2.4)) - 0.055;
    return mix(12.92 * linear, curved, greaterThan(linear, vec3(0.0031308)));
}

// The same curve by two square roots, which every processor rounds alike: a fit of our own to IEC 61966-2-1 over
// 0.0031308..1, at most 0.009/255 off. linear: 0..1.
vec3 srgb_by_roots(vec3 linear)
{
    vec3 root = sqrt(linear);
    vec3 fourth = sqrt(root);
    vec3 curved = 0.08132954 * linear + 1.12267099 * root + (0.1961417 - 0.33549519 * root) * fourth - 0.06461252;
    return mix(12.92 * linear, curved, greaterThan(linear, vec3(0.0031308)));
}

// The nearest half float, as a float: drivers store what already is one without a change, while they round others each
// in its own way (Mesa on a CPU cuts off). Below 6e-5, where halves lose digits, the driver decides.
vec3 rounded_to_half(vec3 c)
{
    return uintBitsToFloat((floatBitsToUint(c) + 0x1000u) & 0xffffe000u);
}
