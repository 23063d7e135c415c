// The height of what lies below the water, seen from above.

in vec3 position_world;

layout(location = 0) out float height;

void main()
{
    height = position_world.y;
}
