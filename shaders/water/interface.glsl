// What every technique defines, and what it is given. passes/water.* know only these.

struct WaterPoint
{
    vec3 position;           // world, metres
    vec3 view;               // unit, from the surface towards the eye
    vec3 up;                 // unit, the plane's normal on the eye's side
    vec2 reflection_place;   // coordinates in the reflection map, 0..1, not perturbed
    vec2 refraction_place;   // coordinates in the refraction map, 0..1, not perturbed
    float sun_visibility;    // 0..1
};

struct WaterShade
{
    vec3 radiance;             // linear
    float reflection_weight;   // share of the reflection map in the blend, 0..1
};
