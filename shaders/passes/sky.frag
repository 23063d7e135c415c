// The sky behind everything.
#if defined(SKY_MODEL_CONSTANT)
#include <ConstantSky>
#elif defined(SKY_MODEL_GRADIENT)
#include <GradientSky>
#else
#include <SkyLight>
#include "lib/sky.glsl"
uniform sampler2D sky_map;
#endif

in vec3 ray_world;

layout(location = 0) out vec4 color;

void main()
{
#if defined(SKY_MODEL_CONSTANT)
    color = vec4(constant_sky.color, 1.0);
#elif defined(SKY_MODEL_GRADIENT)
    float height = max(ray_world.y, 0.0) * inversesqrt(dot(ray_world, ray_world));
    color = vec4(mix(gradient_sky.horizon, gradient_sky.zenith, sqrt(height)), 1.0);
#else
    color = vec4(textureLod(sky_map, sky_place(ray_world), 0.0).rgb, 1.0);
#endif
}
