// The water, shaded by its technique.
#include <View>
#include <WaterPlane>
#include <technique>
#include "lib/colour.glsl"
#include "lib/projection.glsl"
#include "lib/shadow.glsl"

#ifdef NEEDS_DEPTH
uniform sampler2D bed_map;  // height of the bed, metres
#endif

in vec3 position_world;
in vec4 reflection_clip;
in vec4 refraction_clip;
in vec3 shadow_place;

layout(location = 0) out vec4 result;

void main()
{
    WaterPoint point;
    point.position = position_world;
    point.view = normalize(view.eye.xyz - position_world * view.eye.w);
    point.up = vec3(0.0, water_plane.side, 0.0);
    vec2 pixel_place = gl_FragCoord.xy / water_plane.picture_size;
#ifdef REFLECTION_IS_ALIGNED
    point.reflection_place = pixel_place;
#else
    point.reflection_place = map_place(reflection_clip);
#endif
#ifdef REFRACTION_IS_ALIGNED
    point.refraction_place = pixel_place;
#else
    point.refraction_place = map_place(refraction_clip);
#endif
    point.sun_visibility = sun_visibility(shadow_place);
    point.plane_place = (position_world.xz - water_plane.extents.xz) / (water_plane.extents.yw - water_plane.extents.xz);
#ifdef NEEDS_DEPTH
    point.depth = max(water_plane.level - texture(bed_map, vec2(point.plane_place.x, 1.0 - point.plane_place.y)).r, 0.0);
#endif
#ifdef NEEDS_DISTANCE
    point.distance = distance_to_eye(position_world, view.eye, view.eye_reach);
#endif
    WaterShade shade = shade_water(point);
#if defined(SHOWS_WEIGHT)
    result = vec4(rounded_to_half(vec3(shade.reflection_weight)), 1.0);
#elif defined(SHOWS_MASK)
    result = vec4(1.0);
#elif defined(SHOWS_PERTURBATION)
    result = vec4(rounded_to_half(vec3(0.5 + 0.5 * shade.shift / max(water_plane.reach, vec2(1e-6)), 0.0)), 1.0);
#elif defined(SHOWS_VALIDITY)
    result = vec4(vec3(shade.validity), 1.0);
#else
    result = vec4(rounded_to_half(shade.radiance), shade.opacity);
#endif
}
