// How plants move.
#include <Wind>

// Displacement of a vertex in metres. weight: 0 rigid .. 1; phases are reduced on the CPU, so that late times stay sharp.
vec3 sway(vec3 position, float weight)
{
    float place = dot(position.xz, vec2(0.31, 0.23));
    float slow = sin(wind.slow_phase + place);
    float fast = sin(wind.fast_phase + place * 5.3);
    float lean = weight * (0.055 * slow + 0.018 * fast);
    return vec3(lean, -0.2 * abs(lean), 0.55 * lean);
}
