// Projective texturing.

// Everitt 2001, section 2: from clip space to a map's coordinates, divided per pixel; dividing per vertex warps at
// grazing angles. clip: w > 0 in front of the map's camera. v runs upwards, as the map's rows do.
vec2 map_place(vec4 clip)
{
    return 0.5 * clip.xy / clip.w + 0.5;
}
