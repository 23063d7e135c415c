// On which side of the water something lies, seen from the eye.
#include <Light>
#include <View>

// 1 where the water's plane lies between the eye and this height, 0 where it does not. y: world, metres.
float seen_through_water(float y)
{
    float eye = view.eye.w > 0.0 ? view.eye.y - light.water_level : view.eye.y;
    return (y - light.water_level) * (eye < 0.0 ? -1.0 : 1.0) < 0.0 ? 1.0 : 0.0;
}
