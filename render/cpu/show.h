/* Occlusion culling of the voxels of a batch's runs: squares of which every pixel lies in saturated
 * blocks are left out. Any thread may call it while others blend. */
#ifndef TRIP_CPU_SHOW_H
#define TRIP_CPU_SHOW_H

#include "cpu/cover.h"
#include "cpu/squares.h"

/* What a thread culls by. */
typedef struct trip_cpu_culling {
    const trip_cpu_kernels *kernels;
    const trip_cpu_view *view; /* of the runs' list */
    const trip_cpu_mask *mask;
    trip_cpu_lanes *lanes; /* to work in */
} trip_cpu_culling;

/* Leaves in `part` only squares that may show, and counts their voxels. */
void trip_cpu_show(const trip_cpu_culling *culling, const trip_block *block, trip_cpu_part *part);

#endif
