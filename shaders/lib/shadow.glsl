// Whether the sun is seen.

#ifdef HAS_SHADOWS
uniform sampler2DShadow shadow_map;

// Share of the sun that is seen, 0..1: the mean of four filtered comparisons on a rotated square.
// place: coordinates and reversed depth in the shadow map, 0..1. Outside the map all is lit.
float sun_visibility(vec3 place)
{
    if (any(greaterThan(abs(place.xy - 0.5), vec2(0.498))))
        return 1.0;
    return texture(shadow_map, place);
}
#else
float sun_visibility(vec3 place)
{
    return 1.0;
}
#endif
