// Lets the surfels of a batch take their cells, in three stages. Each cell takes the least z' - t,
// then the least number among equal ones, then the surfel with both.
// In: the batch. In and out: the cells.
// Mirrors lower_key() and write_some() in render/surfels/surfels_cpu.c.
#include "surfel.glsl"

layout(local_size_x = TRIP_GL_SURFEL_GROUP) in;
layout(std430, binding = TRIP_GL_SURFELS) readonly buffer trip_gl_surfels { trip_gl_surfel surfels[]; };
layout(std430, binding = TRIP_GL_SURFEL_PLACES) readonly buffer trip_gl_places { uvec2 places[]; };
layout(binding = TRIP_GL_SURFEL_IMAGE_FRONTS, r32ui) restrict uniform uimage2D fronts;
layout(binding = TRIP_GL_SURFEL_IMAGE_NUMBERS, r32ui) restrict uniform uimage2D numbers;
layout(binding = TRIP_GL_SURFEL_IMAGE_HOLDERS, rgba32f) restrict writeonly uniform image2DArray holders;
layout(location = TRIP_GL_SURFEL_COUNT) uniform uint count;
layout(location = TRIP_GL_SURFEL_STAGE) uniform int stage;
layout(location = TRIP_GL_SURFEL_PITCH) uniform uint pitch; // cells of a row

void main()
{
    uint n = gl_GlobalInvocationID.x;
    if (n >= count || places[n].x == TRIP_GL_NO_CELL)
        return;
    ivec2 cell = ivec2(places[n].x % pitch, places[n].x / pitch);
    uint front = floatBitsToUint(surfels[n].at[DISC].w), number = places[n].y;
    if (stage == 0) {
        if (front < imageAtomicMin(fronts, cell, front))
            imageStore(numbers, cell, uvec4(0xffffffffu));
    } else if (front == imageLoad(fronts, cell).x) {
        if (stage == 1)
            imageAtomicMin(numbers, cell, number);
        else if (number == imageLoad(numbers, cell).x)
            for (int i = 0; i < TRIP_GL_SURFEL_LAYERS; i++)
                imageStore(holders, ivec3(cell, i), surfels[n].at[i]);
    }
}
