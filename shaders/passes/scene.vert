// The scene's surfaces.
#include <View>
#include "lib/wind.glsl"
#ifdef SHADOWS_BY_VERTEX
#include "lib/shadow.glsl"
#endif

in vec3 position;
in vec3 normal;
in vec2 uv;
in vec4 color;

out vec3 position_world;
out vec3 normal_world;
out vec2 surface_uv;
out vec4 surface_color;
#ifdef SHADOWS_BY_VERTEX
out float sun_seen;
#else
out vec3 shadow_place;
#endif

void main()
{
    position_world = position;
#if defined(SWAYS) && !defined(STANDS_STILL)
    position_world += sway(position, color.a);
#endif
    normal_world = normal;
    surface_uv = uv;
    surface_color = color;
#ifdef SHADOWS_BY_VERTEX
    // Leaves are small and their crowns' shadows soft: a lookup for each corner serves where they cover many pixels.
#ifdef HAS_SHADOWS
    sun_seen = sun_visibility((view.shadow_from_world * vec4(position_world + view.shadow_offset * normal, 1.0)).xyz);
#else
    sun_seen = 1.0;
#endif
#elif defined(HAS_SHADOWS)
    // Moved along the normal, so that a surface does not shadow itself; the map is parallel: no division.
    shadow_place = (view.shadow_from_world * vec4(position_world + view.shadow_offset * normal, 1.0)).xyz;
#else
    shadow_place = vec3(0.0);
#endif
    gl_Position = view.clip_from_world * vec4(position_world, 1.0);
#ifdef CLIPS
    gl_ClipDistance[0] = dot(view.clip_plane, vec4(position_world, 1.0));
#endif
}
