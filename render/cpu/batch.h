/* From a batch to splats: cuts it into chunks, which the workers cull, project and sort by pane
 * while the splats before them are blended. Called by the renderer's thread. */
#ifndef TRIP_CPU_BATCH_H
#define TRIP_CPU_BATCH_H

#include "cpu/state.h"

/* All splats of a batch, with the views of the layer's lists; ends with its bytes no longer needed.
 */
int trip_cpu_draw_batch(trip_cpu *r, const trip_batch *batch);

/* A square of a run of the batch at hand, with room to be read about its bytes. Called by workers.
 */
trip_cpu_square trip_cpu_make_square(const trip_cpu *r, trip_cpu_worker *w, const trip_block *b,
                                     const trip_run *run, const trip_square *at);

#endif
