// On which side of the water something lies.
#include <Light>

// 1 where the water's plane lies between the picture's eye and this height, 0 where it does not. y: world, metres.
float seen_through_water(float y)
{
    return step(light.eye_side * y, light.eye_side * light.water_level);
}
