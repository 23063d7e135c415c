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
