// From scene light to display light, both linear, 0.. to 0..1.

// Reinhard 2002, equation 3, on luminance so that hues stay.
vec3 tonemap_reinhard(vec3 c)
{
    float luminance = dot(c, vec3(0.2126, 0.7152, 0.0722));
    return min(c / (1.0 + luminance), vec3(1.0));
}

// Narkowicz 2015: a rational fit of the ACES reference rendering.
vec3 tonemap_aces(vec3 c)
{
    return clamp(c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0);
}

// Sobotka 2023 (AgX), with Wrensch 2023's sixth-order fit of its contrast curve. Returns display-linear light.
vec3 tonemap_agx(vec3 c)
{
    const mat3 inset = mat3(0.842479062253094, 0.0423282422610123, 0.0423756549057051,
                            0.0784335999999992, 0.878468636469772, 0.0784336,
                            0.0792237451477643, 0.0791661274605434, 0.879142973793104);
    const mat3 outset = mat3(1.19687900512017, -0.0528968517574562, -0.0529716355144438,
                             -0.0980208811401368, 1.15190312990417, -0.0980434501171241,
                             -0.0990297440797205, -0.0989611768448433, 1.15107367264116);
    const float low = -12.47393;
    const float high = 4.026069;
    vec3 x = (clamp(log2(max(inset * c, vec3(1e-10))), low, high) - low) / (high - low);
    vec3 x2 = x * x;
    vec3 x4 = x2 * x2;
    vec3 curve = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    return clamp(pow(max(outset * curve, vec3(0.0)), vec3(2.2)), 0.0, 1.0);
}
