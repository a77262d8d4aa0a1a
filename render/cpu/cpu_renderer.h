/* Occlusion test of the CPU renderer for the reader. renderer.h declares all other functions of the
 * renderer. */
#ifndef TRIP_CPU_RENDERER_H
#define TRIP_CPU_RENDERER_H

#include "renderer.h"

/* Returns true only if no voxel of the run's brick can change the current layer. Then every pixel
 * in reach is terminated, has no weight or lies outside the image. So the picture is the same, bit
 * for bit, with or without the brick.
 *
 * Use it as trip_reader_params.skip with the renderer as skip_user. Called on the thread that
 * draws. Returns false for other renderers. */
bool trip_cpu_occluded(void *renderer, const trip_selection *selection, const trip_run *run);

#endif
