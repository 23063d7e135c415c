// Solid things: stone, wood, hills, and a user's model. Vertex colours, with an optional colour map and an optional
// detail map along the same uv; for the detail map uv is in metres along the surface.
#include <Material>
#include "lib/surface.glsl"
#include "lib/colour.glsl"

#ifdef HAS_ALBEDO_MAP
uniform sampler2D albedo_map;
#endif
#ifdef HAS_DETAIL_MAP
uniform sampler2D detail_map;

// Mikkelsen 2010, "Bump mapping unparametrized surfaces on the GPU", with the slope known along uv: no tangents.
// n: unit. slope: rise of the surface along u and v, per metre. Where a triangle has no area, n stays.
vec3 bumped_normal(vec3 n, vec3 position, vec2 uv, vec2 slope)
{
    vec3 right = dFdx(position);
    vec3 up = dFdy(position);
    vec3 across_up = cross(up, n);
    vec3 across_right = cross(n, right);
    float area = dot(right, across_up);
    vec3 gradient = dot(slope, dFdx(uv)) * across_up + dot(slope, dFdy(uv)) * across_right;
    vec3 bumped = abs(area) * n - sign(area) * gradient;
    return abs(area) > 1e-20 ? normalize(bumped) : n;
}
#endif

Surface material_surface(vec3 position_world, vec3 normal_world, vec2 uv, vec4 color)
{
    Surface surface = Surface(material.albedo * color.rgb, normal_world, 1.0, material.translucency);
#ifdef HAS_ALBEDO_MAP
    vec4 texel = texture(albedo_map, uv);
    surface.albedo *= linear_from_root(texel.rgb);
    surface.alpha = texel.a;
#endif
#ifdef HAS_DETAIL_MAP
    vec4 detail = texture(detail_map, uv / material.detail_tile);
    surface.albedo *= 2.0 * detail.b;
    surface.normal = bumped_normal(normal_world, position_world, uv, 1.0 - 2.0 * detail.rg);
#endif
    return surface;
}
