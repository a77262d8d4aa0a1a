/* Occlusion culling of the runs of a batch. Leaves out a square if all its pixels are terminated.
 * Any thread may call it while others blend. */
#ifndef TRIP_CPU_CULL_H
#define TRIP_CPU_CULL_H

#include "cpu/occlusion.h"
#include "cpu/squares.h"

/* The inputs of one thread's culling. */
typedef struct trip_cpu_culling {
    const trip_cpu_kernels *kernels;
    const trip_cpu_view *view; /* view of the runs' list */
    const trip_cpu_mask *mask;
    trip_cpu_lanes *lanes; /* scratch of the thread */
} trip_cpu_culling;

/* Removes squares from `part` that cannot be visible, and updates its voxel count. */
void trip_cpu_cull(const trip_cpu_culling *culling, trip_cpu_part *part);

#endif
