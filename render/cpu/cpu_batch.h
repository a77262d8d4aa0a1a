/* From a batch to splats: cuts it into chunks, which the workers cull, project and sort by pane
 * while the splats before them are blended. Called by the renderer's thread. */
#ifndef TRIP_CPU_BATCH_H
#define TRIP_CPU_BATCH_H

#include "cpu/cpu_state.h"

/* All splats of a batch, with the views of the layer's lists; ends with its bytes no longer needed.
 */
int trip_cpu_draw_batch(trip_cpu *r, const trip_batch *batch);

/* What holds for all squares of a part of the batch at hand. */
typedef struct trip_cpu_part_squares {
    const trip_cpu *of;
    const trip_cpu_part *part;
    bool as_they_are; /* all of their voxels are drawn, and there is room behind their bytes */
} trip_cpu_part_squares;

trip_cpu_part_squares trip_cpu_part_squares_of(const trip_cpu *r, const trip_cpu_part *part);

/* One of them, with room to be read behind its bytes. Called by workers. */
trip_cpu_square trip_cpu_make_square(const trip_cpu_part_squares *of, trip_cpu_worker *w,
                                     const trip_square *at);

#endif
