/* Memory of a frame's panes, blending of splat buffers into panes, and the merge of layers. The
 * panes belong to the renderer; its thread calls all functions. */
#ifndef TRIP_CPU_PANES_H
#define TRIP_CPU_PANES_H

#include "cpu/cpu_state.h"

/* Takes memory for the frame's panes. Fails with TRIP_ERROR if the budget has too little left. */
int trip_cpu_fit_panes(trip_cpu *r, int width, int first_row, int rows);
void trip_cpu_release_panes(trip_cpu *r);

/* Empties all panes at the start of a frame. */
void trip_cpu_begin_panes(trip_cpu *r);
/* Opens every pane in which the current layer may have weight; marks the others as terminated. */
void trip_cpu_begin_pane_layer(trip_cpu *r);

/* Returns the depths of the buffer's splats from `splat` on, or NULL if the buffer has none. */
static inline float *trip_cpu_depths_from(const trip_cpu_buffer *f, uint32_t splat)
{
    return f->depths ? f->depths + splat : NULL;
}

/* Starts blending the filled buffer, after waiting for the previous one. */
void trip_cpu_blend_filled(trip_cpu *r);
/* Blends the filled buffer and waits until all splats so far are in the pixels. */
void trip_cpu_finish_blending(trip_cpu *r);

/* Adds the current layer, with all its batches drawn, to the sum of layers. */
void trip_cpu_merge_layer(trip_cpu *r);
/* Writes the picture of everything drawn so far. `depth` may be NULL. */
void trip_cpu_finish_picture(trip_cpu *r, float *rgba, float *depth);

#endif
