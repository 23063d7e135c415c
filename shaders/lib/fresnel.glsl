// How much of what is seen on water is reflected, how much refracted.

// Luna 2006, section 4: weight of the refraction map. NoV: cosine of the view angle; bias may be negative; power > 0.
float luna_refraction_weight(float NoV, float bias, float power)
{
    return clamp(bias + pow(max(NoV, 0.0), power), 0.0, 1.0);
}
