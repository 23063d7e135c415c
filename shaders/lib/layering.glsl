// Layers of colour, one over another.

// What is seen through a layer. above: colour times alpha, and alpha; opacity: factor on both, 0..1.
vec3 layered(vec3 beneath, vec4 above, float opacity)
{
    return beneath * (1.0 - opacity * above.a) + opacity * above.rgb;
}
