/* Exact counts of splats (trip_list_stats), for frames whose `count` is set: every voxel is
 * projected once more with a table in which all are visible. */
#ifndef TRIP_CPU_COUNT_H
#define TRIP_CPU_COUNT_H

#include "cpu/cpu_state.h"

#define TRIP_CPU_COUNT_TABLE_BYTES (65536 * sizeof(trip_tf_entry))

/* The frame that is counted, from the one being drawn. */
int trip_cpu_begin_counting(trip_cpu *r);

/* Adds those of a run's part to the chunk's counts: also what is occluded or transparent. Called by
 * the worker that fills the chunk. */
void trip_cpu_count_part(const trip_cpu *r, trip_cpu_worker *w, trip_cpu_chunk *chunk,
                         const trip_cpu_part *part);

#endif
