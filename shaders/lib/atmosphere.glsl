// The clear air: Rayleigh, aerosol and ozone round a spherical planet, lit by white light of irradiance 1 outside it.
// Conventions: lengths in kilometres, coefficients per kilometre. Light is four wavelengths in a vec4: 640, 590, 520 and
// 440 nm; three, however chosen, miss the colours of a low sun (tests/reference/sky.py integrates the whole spectrum).
// h is the height above sea level, 0..100; mu the cosine of an angle with the local upward vertical, -1..1.

const float PI = 3.14159265358979;
const float PLANET_RADIUS = 6360.0;                                     // Bruneton & Neyret 2008, section 2
const float AIR_HEIGHT = 100.0;                                         // Hillaire 2020, section 4
const vec4 RAYLEIGH = vec4(7.3946e-3, 10.2384e-3, 16.9677e-3, 33.0998e-3);  // 1.24062e-3 / micrometres^4, Penndorf 1957
const float RAYLEIGH_SCALE = 8.0;                                       // Bruneton & Neyret 2008, section 2.1
const float AEROSOL_SCALE = 1.2;                                        // the same
const vec4 AEROSOL_COLOR = vec4(0.8212, 0.9127, 1.0756, 1.3366);        // (wavelength / 550 nm)^-1.3, Angstrom 1929
const float AIR_DEPTH = 0.10846;                                        // vertical Rayleigh optical depth at 550 nm
const float AEROSOL_ALBEDO = 0.94;                                      // scattering over extinction: clean land air
const vec4 OZONE = vec4(1.430e-3, 2.531e-3, 1.150e-3, 0.086e-3);
const float OZONE_HEIGHT = 25.0;
const float OZONE_HALF_WIDTH = 15.0;
const float SUN_RADIUS = 0.0046531;                              // radians, 0.2666 degrees
const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);                     // of linear sRGB, IEC 61966-2-1
const float GROUND_ALBEDO = 0.25;                                // vegetated land, for light sent back into the air

// Four wavelengths to linear sRGB, as a fit to spectra of air masses 0.3 to 40 under the colour matching functions of
// Wyman et al. 2013: 0.4 % rms of luminance. Sunlight outside the air is white. Deep reds leave the gamut and are clipped.
vec3 color_from_spectrum(vec4 light)
{
    const mat4x3 FIT = mat4x3(0.4858, -0.0715, 0.0127, 0.8787, 0.3806, -0.1575, -0.4099, 0.7713, 0.2317, 0.0454, -0.0804, 0.9131);
    return max(FIT * light, 0.0);
}

// Aerosol extinction at sea level. Turbidity is the vertical optical depth of air and aerosol over that of air alone
// (Preetham et al. 1999, section 2), at 550 nm. turbidity: 1..10.
vec4 aerosol_extinction(float turbidity)
{
    return AEROSOL_COLOR * ((turbidity - 1.0) * AIR_DEPTH / AEROSOL_SCALE);
}

// Ozone's density over that at its middle: a tent (Bruneton 2017, as cited by Hillaire 2020, section 4). h: km.
float ozone_density(float h)
{
    return max(0.0, 1.0 - abs(h - OZONE_HEIGHT) / OZONE_HALF_WIDTH);
}

// Scaled complementary error function exp(z^2) erfc(z), relative error 1.2e-7 (Press et al. 1992, section 6.2).
// z: 0 or more.
float erfcx(float z)
{
    float t = 1.0 / (1.0 + 0.5 * z);
    float p = -0.82215223 + t * 0.17087277;
    p = -1.13520398 + t * (1.48851587 + t * p);
    p = 0.09678418 + t * (-0.18628806 + t * (0.27886807 + t * p));
    return t * exp(-1.26551223 + t * (1.00002368 + t * (0.37409196 + t * p)));
}

// Length of an exponential atmosphere seen from h to infinity, in kilometres of its density at sea level: Chapman 1931
// in its closed form for a planet much larger than the scale height (Fitzmaurice 1964). scale: scale height, km.
// Downward rays count as if the planet were transparent: occlusion is sun_visibility's.
float exponential_length(float h, float mu, float scale)
{
    float r = PLANET_RADIUS + h;
    float up = exp(-h / scale) * sqrt(0.5 * PI * r * scale) * erfcx(sqrt(0.5 * r / scale) * abs(mu));
    float sine = sqrt(max(0.0, 1.0 - mu * mu));
    float drop = r * mu * mu / (1.0 + sine);
    float perigee = 2.0 * exp((drop - h) / scale) * sqrt(0.5 * PI * (r - drop) * scale) - up;
    return mu < 0.0 ? perigee : up;
}

// Share of the ozone column that lies above h: the tent's integral. h: km. Returns 0..1.
float ozone_above(float h)
{
    float x = clamp((h - OZONE_HEIGHT) / OZONE_HALF_WIDTH, -1.0, 1.0);
    return 0.5 - x + 0.5 * x * abs(x);
}

// Slant factor of the ozone layer taken as a shell at its middle, for a ray that starts at h and climbs. The floor under
// the cosine is the shell's own thickness: without it a ray that grazes the middle would diverge.
float ozone_slant(float h, float mu)
{
    float r = PLANET_RADIUS + h;
    float shell = PLANET_RADIUS + max(OZONE_HEIGHT, h);
    float sine2 = (1.0 - mu * mu) * (r * r) / (shell * shell);
    return inversesqrt(max(1.0 - sine2, 0.003));
}

// Length of the ozone layer from h to infinity, in kilometres of its middle's density. Downward rays go through their
// perigee and out again.
float ozone_length(float h, float mu)
{
    float up = ozone_above(h) * ozone_slant(h, abs(mu));
    float sine = sqrt(max(0.0, 1.0 - mu * mu));
    float perigee = h - (PLANET_RADIUS + h) * mu * mu / (1.0 + sine);
    float through = 2.0 * ozone_above(perigee) * ozone_slant(max(perigee, 0.0), 0.0) - up;
    return OZONE_HALF_WIDTH * (mu < 0.0 ? max(through, up) : up);
}

// Optical depth from h to infinity along mu, per wavelength. turbidity: 1..10.
vec4 optical_depth(float h, float mu, float turbidity)
{
    return RAYLEIGH * exponential_length(h, mu, RAYLEIGH_SCALE)
        + aerosol_extinction(turbidity) * exponential_length(h, mu, AEROSOL_SCALE)
        + OZONE * ozone_length(h, mu);
}

// Share of the sun's disc above the planet's limb, 0..1, smooth. h: km; mu: cosine of the sun's zenith angle.
float sun_visibility(float h, float mu)
{
    float r = PLANET_RADIUS + h;
    float sine = sqrt(max(0.0, 1.0 - mu * mu));
    float perigee = h - r * mu * mu / (1.0 + sine);
    float width = max(r * abs(mu) * SUN_RADIUS, 0.05);
    return mu < 0.0 ? smoothstep(-width, width, perigee) : 1.0;
}

// Sunlight left at h, per wavelength, 0..1. mu: cosine of the sun's zenith angle; turbidity: 1..10.
vec4 sun_transmittance(float h, float mu, float turbidity)
{
    return exp(-optical_depth(h, mu, turbidity)) * sun_visibility(h, mu);
}

// Height at distance t along a ray that starts at h under mu; the difference of squares is expanded because both are
// near 6360^2 and would cancel. t: km.
float height_along(float h, float mu, float t)
{
    float r = PLANET_RADIUS + h;
    float rise = t * (t + 2.0 * r * mu);
    return h + rise / (sqrt(r * r + rise) + r);
}

// Distance from h along an upward mu to the height `to`, km; to >= h >= 0.
float distance_to_height(float h, float mu, float to)
{
    float r = PLANET_RADIUS + h;
    float b = r * mu;
    float c = (to - h) * (2.0 * PLANET_RADIUS + to + h);
    return c / (sqrt(b * b + c) + b);
}

// Rayleigh 1871; normalised as in Bruneton & Neyret 2008, section 2.1. cosine: of the angle of scattering. Per steradian.
float rayleigh_phase(float cosine)
{
    return 3.0 / (16.0 * PI) * (1.0 + cosine * cosine);
}

// Henyey & Greenstein 1941, equation 2. g: mean cosine, -1..1. Per steradian.
float henyey_greenstein(float cosine, float g)
{
    float d = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (4.0 * PI * d * sqrt(d));
}

// Cornette & Shanks 1992, equation 8. g: asymmetry, -1..1. Per steradian.
float cornette_shanks(float cosine, float g)
{
    float d = 1.0 + g * g - 2.0 * g * cosine;
    return 3.0 / (8.0 * PI) * (1.0 - g * g) * (1.0 + cosine * cosine) / ((2.0 + g * g) * d * sqrt(d));
}

// Aerosol's phase function: fine haze and, one part in twelve, coarse grains that draw the bright ring round the sun.
float aerosol_phase(float cosine)
{
    return mix(cornette_shanks(cosine, 0.72), cornette_shanks(cosine, 0.95), 1.0 / 12.0);
}
