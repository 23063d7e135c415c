// Glints of the sun.

// Phong 1975, equation 4: the lobe about the mirrored light. n l v: unit, away from the surface; power >= 1.
// Nothing where the light comes from behind.
float phong_lobe(vec3 n, vec3 l, vec3 v, float power)
{
    float NoL = dot(n, l);
    vec3 mirrored = 2.0 * NoL * n - l;
    return NoL > 0.0 ? pow(max(dot(mirrored, v), 0.0), power) : 0.0;
}
