/* Converts a frame's effects to the form that the kernels read. Pure function. */
#ifndef TRIP_CPU_FRAME_EFFECTS_H
#define TRIP_CPU_FRAME_EFFECTS_H

#include "cpu/kernels/kernel_effects.h"
#include "renderer.h"

/* Makes the effects for lists along `axis`. `grid` is the list's grid; NULL selects positions of
 * level 0. */
void trip_cpu_effects_make(trip_cpu_effects *out, const trip_frame *frame, int axis,
                           const trip_list_grid *grid);

#endif
