// Finds the greatest depth of each block of pixels. Bits of floats are in their order.
// Mirrors greatest_of() in render/surfels/depth_pyramid.c.
#include "surfel.glsl"

layout(local_size_x = TRIP_GL_SQUARE_GROUP, local_size_y = TRIP_GL_SQUARE_GROUP) in;
layout(binding = TRIP_GL_SURFEL_IMAGE_DEPTHS, r32ui) restrict readonly uniform uimage2D depths;
layout(binding = TRIP_GL_SURFEL_IMAGE_BLOCKS, r32ui) restrict writeonly uniform uimage2D blocks;

void main()
{
    ivec2 block = ivec2(gl_GlobalInvocationID.xy), corner = block * TRIP_GL_SURFEL_BLOCK;
    if (any(greaterThanEqual(corner, picture)))
        return;
    ivec2 end = min(corner + TRIP_GL_SURFEL_BLOCK, picture);
    uint most = 0u;
    for (int y = corner.y; y < end.y; y++)
        for (int x = corner.x; x < end.x; x++)
            most = max(most, imageLoad(depths, ivec2(x, y)).x);
    imageStore(blocks, block, uvec4(most));
}
