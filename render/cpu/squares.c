#include "cpu/squares.h"

#include <string.h>

trip_cpu_part trip_cpu_part_make(const trip_run *run, const trip_block *block, bool reversed,
                                 uint32_t skip, uint32_t most)
{
    trip_cpu_part part = { .run = run, .block = *block };
    if (skip == 0 && block->count <= most) {
        memcpy(part.squares, block->present, block->present_words * sizeof *block->present);
        part.voxels = block->count;
        return part;
    }
    trip_cpu_walk w = trip_cpu_walk_begin(block, reversed);
    for (uint32_t i = 0; i < skip; i++)
        trip_cpu_walk_next(&w);
    while (trip_cpu_walk_next(&w) && part.voxels + w.count <= most) {
        part.squares[w.number / 64] |= UINT64_C(1) << w.number % 64;
        part.voxels += w.count;
    }
    return part;
}
