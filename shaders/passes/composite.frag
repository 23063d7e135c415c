// Scene light to the bytes of the picture. The rows are turned here, so that the first one read back is the top one.
#include "lib/colour.glsl"
#include "lib/tonemap.glsl"

uniform sampler2D picture_map;
uniform vec2 size;       // of the output, pixels
uniform float exposure;  // factor

layout(location = 0) out vec3 encoded;

// Jimenez 2014, slide 123: interleaved gradient noise, 0..1.
float gradient_noise(vec2 pixel)
{
    return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

void main()
{
    vec2 pixel = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
#ifdef HAS_OTHER_SIZE
    vec3 c = texture(picture_map, pixel / size).rgb;
#else
    vec3 c = texelFetch(picture_map, ivec2(pixel), 0).rgb;
#endif
#ifdef ENCODES_DATA
    encoded = clamp(c, 0.0, 1.0);
#else
    c = max(c * exposure, vec3(0.0));
#ifdef TONEMAP_NONE
    encoded = srgb_from_linear(min(c, vec3(1.0)));
#else
#if defined(TONEMAP_REINHARD)
    c = tonemap_reinhard(c);
#elif defined(TONEMAP_ACES)
    c = tonemap_aces(c);
#else
    c = tonemap_agx(c);
#endif
    // Triangular noise of one step either way, its two halves from distant places, hides the steps of eight bits.
    float noise = gradient_noise(gl_FragCoord.xy) + gradient_noise(gl_FragCoord.xy + vec2(47.0, 17.0)) - 1.0;
    encoded = srgb_by_roots(c) + noise / 255.0;
#endif
#endif
}
