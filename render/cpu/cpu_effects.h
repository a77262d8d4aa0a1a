/* The effects of a frame as the kernels have them. */
#ifndef TRIP_CPU_FRAME_EFFECTS_H
#define TRIP_CPU_FRAME_EFFECTS_H

#include "cpu/kernels/kernel_effects.h"
#include "renderer.h"

/* Of the lists along an axis; `grid` of a list, or NULL where places are of level 0. */
void trip_cpu_effects_make(trip_cpu_effects *out, const trip_frame *frame, int axis,
                           const trip_list_grid *grid);

#endif
