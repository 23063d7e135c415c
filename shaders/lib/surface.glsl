// What a material says of one point.

struct Surface
{
    vec3 albedo;         // linear, 0..1
    vec3 normal;         // unit, world, on the side that is seen
    float alpha;         // coverage 0..1
    float translucency;  // share of the light from behind that comes through, 0..1
};
