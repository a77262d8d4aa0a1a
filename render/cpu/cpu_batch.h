/* Turns a batch into splats. The renderer's thread cuts the batch into chunks. The workers cull,
 * project and sort the chunks by pane while earlier splats are blended. */
#ifndef TRIP_CPU_BATCH_H
#define TRIP_CPU_BATCH_H

#include "cpu/cpu_state.h"

/* Draws all splats of a batch with the views of the layer's lists. The batch's bytes are not needed
 * after the return. Called by the renderer's thread. */
int trip_cpu_draw_batch(trip_cpu *r, const trip_batch *batch);

/* Facts about all squares of a part of the current batch. */
typedef struct trip_cpu_part_squares {
    const trip_cpu *of;
    const trip_cpu_part *part;
    bool as_they_are; /* all voxels are drawn, and readable bytes follow */
} trip_cpu_part_squares;

trip_cpu_part_squares trip_cpu_part_squares_of(const trip_cpu *r, const trip_cpu_part *part);

/* Returns one square of the part, with its drawn voxels only; the mask is 0 if there are none.
 * TRIP_CPU_READABLE bytes after its codes and normals may be read. Called by workers. */
trip_cpu_square trip_cpu_make_square(const trip_cpu_part_squares *of, trip_cpu_worker *w,
                                     const trip_square *at);

/* ---- count.c ----
 *
 * Exact counts of splats (trip_list_stats), for frames with trip_frame.count set. Every voxel is
 * projected once more, with a table in which all codes are visible. */

#define TRIP_CPU_COUNT_TABLE_BYTES (65536 * sizeof(trip_tf_entry))

/* Makes r->counted_frame from the current frame. Fails with TRIP_ERROR if memory is exhausted.
 * Called by the renderer's thread. */
int trip_cpu_begin_counting(trip_cpu *r);

/* Adds the splats of a run's part to the chunk's counts, including occluded and transparent ones.
 * Called by the worker that fills the chunk. */
void trip_cpu_count_part(const trip_cpu *r, trip_cpu_worker *w, trip_cpu_chunk *chunk,
                         const trip_cpu_part *part);

#endif
