// The shape of water whose surface stays in its plane.

// Height above the water's level, metres. place: world x and z, metres.
float surface_height(vec2 place)
{
    return 0.0;
}
