// How much of what is seen on water is reflected, how much refracted.

// Luna 2006, section 4: weight of the refraction map. NoV: cosine of the view angle; bias may be negative; power > 0.
float luna_refraction_weight(float NoV, float bias, float power)
{
    return clamp(bias + pow(max(NoV, 0.0), power), 0.0, 1.0);
}

// What a way leaves of the refraction weight. Luna 2006, section 4, asks that it fall with the water's depth and the
// viewer's distance, and leaves the formula open; this one falls as light does in a medium. rate: 1/m, >= 0; way: m, >= 0.
float refraction_weight_left(float rate, float way)
{
    return exp(-rate * way);
}
