// The shape of Luna's pond water (Luna 2006, section 5: displacement): the heights whose slopes are its normal maps.
#include <WaterPlane>
#include <Luna>
#include <LunaScroll>
#include "lib/normals.glsl"

uniform sampler2D height_map_0;
uniform sampler2D height_map_1;

// Height of one scrolling map, metres. place: world x and z, metres; tile: metres; offset: now and one period earlier, tiles.
// Waves that the corners of the surface's cells are too few for are left out by the mipmaps.
float scrolled_height(sampler2D map, vec2 place, float tile, vec4 offset, float earlier)
{
    vec2 cell = (water_plane.extents.yw - water_plane.extents.xz) / float(cells);
    float level = log2(max(max(cell.x, cell.y) / tile * float(textureSize(map, 0).x), 1.0));
    float now = textureLod(map, place / tile + offset.xy, level).r;
#ifdef TWO_PHASES
    now = blended_slope(vec2(now), vec2(textureLod(map, place / tile + offset.zw, level).r), earlier).x;
#endif
    return tile * now;
}

// Height above the water's level, metres: the mean of the two maps, as the slopes are. place: world x and z, metres.
float surface_height(vec2 place)
{
    float height_0 = scrolled_height(height_map_0, place, luna.tile_0, luna_scroll.offset_0, luna_scroll.blend_0);
    float height_1 = scrolled_height(height_map_1, place, luna.tile_1, luna_scroll.offset_1, luna_scroll.blend_1);
    return luna.displacement * luna.ripple_height * 0.5 * (height_0 + height_1);
}
