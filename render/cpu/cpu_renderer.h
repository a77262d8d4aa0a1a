/* The CPU renderer beyond renderer.h: what the reader may leave out. */
#ifndef TRIP_CPU_RENDERER_H
#define TRIP_CPU_RENDERER_H

#include "renderer.h"

/* For trip_reader_params.skip with the renderer as skip_user: true only when nothing of the run's
 * brick can change the list being drawn, because every pixel it might reach is saturated, without
 * weight or outside the image. So the picture is the same, bit for bit, whether bricks are left out
 * or not. Called on the thread that draws; false for any other renderer. */
bool trip_cpu_occluded(void *renderer, const trip_selection *selection, const trip_run *run);

#endif
