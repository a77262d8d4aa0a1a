#include "cpu/squares.h"

#include <string.h>

void trip_cpu_part_make(trip_cpu_part *part, const trip_run *run, const trip_block *block,
                        bool reversed, uint32_t skip, uint32_t max)
{
    part->run = run;
    part->block = *block;
    if (skip == 0 && block->count <= max) {
        for (unsigned i = 0; i < block->present_words; i++)
            part->squares[i] = block->present[i];
        part->voxels = block->count;
        return;
    }
    memset(part->squares, 0, sizeof part->squares);
    part->voxels = 0;
    trip_cpu_walk w = trip_cpu_walk_begin(block, reversed);
    for (uint32_t i = 0; i < skip; i++)
        trip_cpu_walk_next(&w);
    while (trip_cpu_walk_next(&w) && part->voxels + w.count <= max) {
        part->squares[w.number / 64] |= UINT64_C(1) << w.number % 64;
        part->voxels += w.count;
    }
}
