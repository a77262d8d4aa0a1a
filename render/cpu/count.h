/* Exact counts of splats (trip_list_stats), for frames with trip_frame.count set. Every voxel is
 * projected once more, with a table in which all codes are visible. */
#ifndef TRIP_CPU_COUNT_H
#define TRIP_CPU_COUNT_H

#include "cpu/cpu_state.h"

#define TRIP_CPU_COUNT_TABLE_BYTES (65536 * sizeof(trip_tf_entry))

/* Makes r->counted_frame from the current frame. Fails with TRIP_ERROR if memory is exhausted.
 * Called by the renderer's thread. */
int trip_cpu_begin_counting(trip_cpu *r);

/* Adds the splats of a run's part to the chunk's counts, including occluded and transparent ones.
 * Called by the worker that fills the chunk. */
void trip_cpu_count_part(const trip_cpu *r, trip_cpu_worker *w, trip_cpu_chunk *chunk,
                         const trip_cpu_part *part);

#endif
