// The sky behind everything, and its mirror image in the water's reflection map.
#include <View>
#include "lib/colour.glsl"
#include "lib/sky.glsl"
#if defined(SKY_MODEL_CONSTANT)
#include <ConstantSky>
#elif defined(SKY_MODEL_GRADIENT)
#include <GradientSky>
#else
#include <SkyLight>
uniform sampler2D sky_map;
#endif

#include "lib/waterline.glsl"
#ifdef HAS_FOG
#include "lib/fog.glsl"
#endif

in vec3 ray_world;

layout(location = 0) out vec4 color;

void main()
{
#if defined(SKY_MODEL_CONSTANT)
    color = vec4(constant_sky.color, 1.0);
#elif defined(SKY_MODEL_GRADIENT)
    color = vec4(sky_gradient(ray_world, gradient_sky.horizon, gradient_sky.zenith), 1.0);
#else
    vec4 sky = textureLod(sky_map, sky_place(ray_world), 0.0);
    color = vec4(sky_with_ground(sky.rgb, ray_world, sky_light.ground), 1.0);
#if !defined(SKY_NO_DISC)
    color.rgb += sun_disc(ray_world, sky_light.sun_direction) * sky.a * sky_light.sun_disc;
#endif
#endif
#ifdef HAS_FOG
    color.rgb = fogged_sky(color.rgb, view.eye.xyz * view.eye.w, normalize(ray_world));
#endif
#ifdef IS_ENCODED
    color.rgb = srgb_from_linear(clamp(color.rgb, 0.0, 1.0));
#endif
    color.a = seen_through_water(1e30);  // beyond the water only for an eye below it
}
