// Where a direction lies in the sky's tables, and what the sky sends from it. Directions need no unit length unless it
// is said, so that no pixel pays for one.

const float SKY_STRETCH = 2.0;  // heights count double: the horizon, which pictures show, gets the finer texels
const float TWILIGHT_WARP = 0.5;

// Direction to its place in the sky table, 0..1 each way: the hemi-octahedral map (Cigolle et al. 2014, section 3.4)
// with heights stretched. Directions below the horizon take the place of the horizon above them. d: any length but 0.
vec2 sky_place(vec3 d)
{
    vec2 q = d.xz / (abs(d.x) + abs(d.z) + SKY_STRETCH * max(d.y, 0.0) + 1e-20);
    return vec2(q.x + q.y, q.x - q.y) * 0.5 + 0.5;
}

// The inverse: a place in the sky table to its unit direction, on or above the horizon.
vec3 sky_direction(vec2 place)
{
    vec2 s = place * 2.0 - 1.0;
    vec2 q = vec2(s.x + s.y, s.x - s.y) * 0.5;
    return normalize(vec3(q.x, (1.0 - abs(q.x) - abs(q.y)) / SKY_STRETCH, q.y));
}

// Direction of a row and column in the scattering table (Hillaire 2020, section 5.3): the square keeps rows for the
// horizon. place: x is the azimuth from the sun over pi, y the square root of the elevation over pi/2; both 0..1.
// Returns the sine of the elevation and the azimuth, radians.
vec2 scattering_direction(vec2 place)
{
    return vec2(sin(place.y * place.y * 1.57079633), place.x * 3.14159265);
}

// The inverse. d: unit, on or above the horizon; sun: unit. Straight above or below, where there is no azimuth, any does.
vec2 scattering_place(vec3 d, vec3 sun)
{
    float azimuth = atan(d.x * sun.z - d.z * sun.x, d.x * sun.x + d.z * sun.z + 1e-12);
    float elevation = asin(clamp(d.y, 0.0, 1.0));
    return vec2(abs(azimuth) / 3.14159265, sqrt(elevation / 1.57079633));
}

// Place in the table of multiple scattering (Hillaire 2020, section 5.5.2). The square root packs columns round sunset,
// where the light changes fastest. h: km; mu: cosine of the sun's zenith angle.
vec2 multiple_place(float h, float mu)
{
    return vec2(0.5 + 0.5 * sign(mu) * sqrt(abs(mu)), clamp(h / 100.0, 0.0, 1.0));
}

// A place 0..1 that means the middles of a table's outermost texels, as a texture coordinate. size: texels.
vec2 texel_place(vec2 place, vec2 size)
{
    return (place * (size - 1.0) + 0.5) / size;
}
