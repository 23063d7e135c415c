// Where a direction lies in the sky's tables, and what the sky sends from it. Directions need no unit length unless it
// is said, so that no pixel pays for one.

const float SKY_STRETCH = 2.0;  // heights count double: the horizon, which pictures show, gets the finer texels
const float GROUND_SINE2 = 0.008;   // squared sine of the depression (5 degrees) at which haze has given way to ground
const float SUN_SINE2 = 2.1651e-5;  // squared sine of the sun's radius, 0.2666 degrees

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

// API's gradient: linear in the square root of the direction's height. d: any length but 0; horizon, zenith: linear RGB.
vec3 sky_gradient(vec3 d, vec3 horizon, vec3 zenith)
{
    return mix(horizon, zenith, sqrt(max(d.y, 0.0) * inversesqrt(dot(d, d))));
}

// A sky that is overcast throughout, over its zenith's radiance (Moon & Spencer 1942): three times as bright above as at the
// horizon. Its irradiance is 7/9 pi. height: sine of the elevation, 0..1.
float overcast_shape(float height)
{
    return (1.0 + 2.0 * height) / 3.0;
}

// Below the horizon its haze gives way to ground, without an edge: the weight and its slope start from 0. sky: from the
// table; d: any length but 0; ground: linear RGB.
vec3 sky_with_ground(vec3 sky, vec3 d, vec3 ground)
{
    float down = min(d.y, 0.0);
    float s = min(down * down / (GROUND_SINE2 * dot(d, d)), 1.0);
    return mix(sky, ground, s * (2.0 - s));
}

// The sun's disc, which no table could hold, over its radiance: 1 in the middle and darker to the limb (a polynomial for
// the linear law with coefficient 0.6 of Neckel & Labs 1994, at 550 nm), and round it a glare that falls off with the
// fourth power of the angle. Cut off at the horizon. d: any length but 0; sun: unit.
float sun_disc(vec3 d, vec3 sun)
{
    float c = dot(d, sun);
    float x = (1.0 - c * c / dot(d, d)) * (1.0 / SUN_SINE2);  // (angle / radius)^2; floats hold it to 0.01
    float edge = clamp(3.0 - 2.5 * x, 0.0, 1.0);
    float disc = edge * edge * (3.0 - 2.0 * edge) * (1.0 - 0.25 * x * (1.0 + x));
    float glare = 1.0 / (4.0 + x);
    float above = clamp(250.0 * d.y / (abs(d.x) + abs(d.z) + 1e-20) + 0.5, 0.0, 1.0);
    return c > 0.0 ? (disc + 0.8 * glare * glare) * above : 0.0;
}
