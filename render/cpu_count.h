/* The exact counts of a frame (trip_list_stats), in double precision and by the same functions as
 * the reference renderer's. Called by many threads at once. */
#ifndef TRIP_CPU_COUNT_H
#define TRIP_CPU_COUNT_H

#include "cpu_kernels.h"

/* Counts the splat of a voxel of the view's list. */
void trip_cpu_count(const trip_cpu_view *view, const trip_run *run, uint32_t voxel,
                    trip_list_stats *stats);

#endif
