/* Occlusion culling of the voxels of a batch's runs: squares all of whose pixels are saturated are
 * left out. Any thread may call it while others blend. */
#ifndef TRIP_CPU_CULL_H
#define TRIP_CPU_CULL_H

#include "cpu/occlusion.h"
#include "cpu/squares.h"

/* What a thread culls by. */
typedef struct trip_cpu_culling {
    const trip_cpu_kernels *kernels;
    const trip_cpu_view *view; /* of the runs' list */
    const trip_cpu_mask *mask;
    trip_cpu_lanes *lanes; /* to work in */
} trip_cpu_culling;

/* Leaves in `part` only squares that may be visible, and counts their voxels. */
void trip_cpu_cull(const trip_cpu_culling *culling, trip_cpu_part *part);

#endif
