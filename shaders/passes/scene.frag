// The scene's surfaces under sun and ambient light: albedo * (ambient + sun * max(0, n.l) * visibility). Alpha says whether
// the water lies before them, so that ripples need not look past its edge.
#include <View>
#include <Light>
#include <material>
#include "lib/colour.glsl"
#include "lib/shadow.glsl"
#include "lib/waterline.glsl"
#ifdef HAS_FOG
#include "lib/fog.glsl"
#endif

in vec3 position_world;
in vec3 normal_world;
in vec2 surface_uv;
in vec4 surface_color;
#ifdef SHADOWS_BY_VERTEX
in float sun_seen;
#else
in vec3 shadow_place;
#endif

layout(location = 0) out vec4 radiance;

void main()
{
    vec3 n = normalize(normal_world);
#ifdef TURNS_BACK_FACES
    n = gl_FrontFacing ? n : -n;
#endif
    Surface surface = material_surface(position_world, n, surface_uv, surface_color);
#ifdef HAS_ALPHA_CUTOFF
#ifdef HAS_SAMPLES
    // The edge is one pixel wide, and as many of the pixel's four samples are drawn as lie within it.
    float inside = (surface.alpha - material.alpha_cutoff) / max(fwidth(surface.alpha), 1e-4) + 0.5;
    int covered = int(4.0 * clamp(inside, 0.0, 1.0) + 0.5);
    gl_SampleMask[0] = covered > 2 ? (covered > 3 ? 15 : 7) : (covered > 1 ? 9 : covered);
#else
    if (surface.alpha < material.alpha_cutoff)
        discard;
#endif
#endif
    float NoL = dot(surface.normal, light.sun_direction);
    float received = max(NoL, 0.0);
#ifdef HAS_TRANSLUCENCY
    received += surface.translucency * max(-NoL, 0.0);
#endif
#ifndef SHADOWS_BY_VERTEX
    float sun_seen = sun_visibility(shadow_place);
#endif
    vec3 lit = surface.albedo * (light.ambient + light.sun_radiance * (received * sun_seen));
#ifdef HAS_FOG
    // A parallel view begins in the camera's plane.
    vec3 parallel = position_world + (view.eye_reach - dot(position_world, view.eye.xyz)) * view.eye.xyz;
    lit = fogged(lit, view.eye.w > 0.0 ? view.eye.xyz : parallel, position_world);
#endif
#ifdef IS_ENCODED
    radiance = vec4(srgb_from_linear(clamp(lit, 0.0, 1.0)), seen_through_water(position_world.y));
#else
    radiance = vec4(rounded_to_half(lit), seen_through_water(position_world.y));
#endif
}
