// Surface normals from slopes, y up.

// Unit normal of a surface with these slopes. slope: dy/dx and dy/dz.
vec3 normal_from_slope(vec2 slope)
{
    return normalize(vec3(-slope.x, 1.0, -slope.y));
}

// Blend of two phases of one map with the slope variance of one (weights over the root of the sum of their squares).
// earlier: weight of the second phase, 0..1.
vec2 blended_slope(vec2 now, vec2 before, float earlier)
{
    float later = 1.0 - earlier;
    return (later * now + earlier * before) * inversesqrt(later * later + earlier * earlier);
}
