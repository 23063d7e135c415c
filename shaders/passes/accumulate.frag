// One sub-frame's share of the picture.
uniform sampler2D picture_map;
uniform float share;

layout(location = 0) out vec4 radiance;

void main()
{
    radiance = texelFetch(picture_map, ivec2(gl_FragCoord.xy), 0) * share;
}
