// Projective texturing.

// Everitt 2001, section 2: from clip space to a map's coordinates, divided per pixel; dividing per vertex warps at
// grazing angles. clip: w > 0 in front of the map's camera. v runs upwards, as the map's rows do.
vec2 map_place(vec4 clip)
{
    return 0.5 * clip.xy / clip.w + 0.5;
}

// Metres from the eye to a place. eye: its place and 1, or the direction towards it and 0; reach: of a parallel view, how
// far the eye's plane lies along that direction.
float distance_to_eye(vec3 position, vec4 eye, float reach)
{
    return eye.w > 0.5 ? length(eye.xyz - position) : reach - dot(position, eye.xyz);
}
