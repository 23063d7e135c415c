// What every technique defines, and what it is given. passes/water.* know only these.

struct WaterPoint
{
    vec3 position;           // world, metres
    vec3 view;               // unit, from the surface towards the eye
    vec3 up;                 // unit, the plane's normal on the eye's side
    vec2 plane_place;        // where in the water's rectangle: 0..1 along x and along z
    vec2 reflection_place;   // coordinates in the reflection map, 0..1, not perturbed
    vec2 refraction_place;   // coordinates in the refraction map, 0..1, not perturbed
    float sun_visibility;    // 0..1
#ifdef NEEDS_DEPTH
    float depth;             // of the water below, metres, >= 0
#endif
#ifdef NEEDS_DISTANCE
    float distance;          // from the eye, metres
#endif
};

struct WaterShade
{
    vec3 radiance;             // linear, or encoded for display where maps are
    float opacity;             // over the scene behind, 0..1; 1 where the technique blends nothing
    float reflection_weight;   // share of the reflection map in the blend, 0..1
    vec2 shift;                // of the coordinates in the reflection map by the waves: u to the right, v upwards
    float validity;            // 1 where both maps could be read, 0 where not
};
