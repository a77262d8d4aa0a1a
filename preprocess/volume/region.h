/* A box of voxels of a grid, in index space. */
#ifndef TRIP_REGION_H
#define TRIP_REGION_H

#include <stdbool.h>
#include <stdint.h>

/* The voxels from `first` up to, but not including, `past` along i, j, k. past 0 stands for the end
 * of the grid. */
typedef struct trip_region {
    int64_t first[3], past[3];
} trip_region;

static inline bool trip_region_is_whole(const trip_region *r)
{
    bool whole = true;
    for (int a = 0; a < 3; a++)
        whole = whole && r->first[a] == 0 && r->past[a] == 0;
    return whole;
}

#endif
