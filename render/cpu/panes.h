/* The panes of a frame: their memory, the blending of splat buffers into them, and the merge
 * of their layers. Called by the renderer's thread. */
#ifndef TRIP_CPU_PANES_H
#define TRIP_CPU_PANES_H

#include "cpu/cpu_state.h"

/* Memory for the frame's panes, and for their lists in the splat buffers. */
int trip_cpu_fit_panes(trip_cpu *r, int width, int height);
void trip_cpu_release_panes(trip_cpu *r);

/* Every pane of a frame is empty. */
void trip_cpu_begin_panes(trip_cpu *r);
/* Every pane of the layer that is the view's is open where that may have weight. */
void trip_cpu_begin_pane_layer(trip_cpu *r);

/* Depths of a buffer's splats from one on; NULL where it has none. */
static inline float *trip_cpu_depths_from(const trip_cpu_buffer *f, uint32_t splat)
{
    return f->depths ? f->depths + splat : NULL;
}

/* Hands what is projected to the blending threads, once they are done with what came before. */
void trip_cpu_blend_filled(trip_cpu *r);
/* The same, and ends with everything drawn so far in the pixels. */
void trip_cpu_finish_blending(trip_cpu *r);

/* Adds the layer, all of which was handed in, to the sum of layers. */
void trip_cpu_merge_layer(trip_cpu *r);
/* The picture of what is drawn so far; `depth` NULL without depth. */
void trip_cpu_finish_picture(trip_cpu *r, float *rgba, float *depth);

#endif
