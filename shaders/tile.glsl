// The tiles of a Gaussian scene. Tiles are counted from the first one of a band.
// Mirrors render/gaussians/gaussian_tiles.h.
#include "shared.h"

layout(local_size_x = TRIP_GL_TILE_PIXELS) in;
layout(std430, binding = TRIP_GL_TILE_PLANES) buffer trip_gl_planes { float planes[]; };
layout(std430, binding = TRIP_GL_TILE_CLOSED) buffer trip_gl_closed_pixels { uint closed[]; };
layout(location = TRIP_GL_TILE_GRID) uniform ivec2 grid; // columns of tiles, first tile of the band

#ifdef DEPTH
#define PLANES 5u
#else
#define PLANES 4u
#endif

uint first_tile()
{
    return uint(grid.y);
}

// Returns the pixel of this invocation in the picture. Inverts trip_tile_place().
ivec2 pixel_of(uint tile)
{
    int place = int(gl_LocalInvocationIndex), block = place >> 4, n = grid.y + int(tile);
    ivec2 corner = ivec2(n % grid.x, n / grid.x) * TRIP_GL_TILE_PX;
    return corner + ivec2(block & 3, block >> 2) * 4 + ivec2(place & 3, place >> 2 & 3);
}

// Returns the position of the pixel's transmittance in the planes.
uint plane_of(uint tile)
{
    return tile * (PLANES * uint(TRIP_GL_TILE_PIXELS)) + gl_LocalInvocationIndex;
}
