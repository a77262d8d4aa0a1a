// Empties the planes of tiles: each work group a tile, each invocation a pixel. Pixels beyond the
// picture are closed from the beginning.
// In: nothing. Out: the planes, and the number of closed pixels, added to 0.
// Mirrors clear_tile() in render/gaussians/gaussians_cpu.c.
#include "tile.glsl"

layout(location = TRIP_GL_TILE_PICTURE) uniform ivec2 picture; // width and height

void main()
{
    bool inside = all(lessThan(pixel_of(gl_WorkGroupID.x), picture));
    uint at = plane_of(gl_WorkGroupID.x);
    planes[at] = inside ? 1.0 : -1.0;
    for (uint i = 1u; i < PLANES; i++)
        planes[at + i * uint(TRIP_GL_TILE_PIXELS)] = 0.0;
    if (!inside)
        atomicAdd(closed[first_tile() + gl_WorkGroupID.x], 1u);
}
