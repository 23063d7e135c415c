// Leaves and blades: a cut-out texture or plain blades, vertex colours, and normals that belong to the whole crown, so they
// stay as they are on back faces.
#include <Material>
#include "lib/surface.glsl"
#include "lib/colour.glsl"

#ifdef HAS_ALBEDO_MAP
uniform sampler2D albedo_map;
#endif

Surface material_surface(vec3 position_world, vec3 normal_world, vec2 uv, vec4 color)
{
    Surface surface = Surface(material.albedo * color.rgb, normal_world, 1.0, material.translucency);
#ifdef HAS_ALBEDO_MAP
    vec4 texel = texture(albedo_map, uv);
    surface.albedo *= linear_from_root(texel.rgb);
    surface.alpha = texel.a;
#endif
    return surface;
}
