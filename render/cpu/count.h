/* What a voxel counts for before any kernel is asked (trip_list_stats): the bounds by which whole
 * bricks are culled, taken for one splat. Called by many threads at once. */
#ifndef TRIP_CPU_COUNT_H
#define TRIP_CPU_COUNT_H

#include "cpu/kernels/kernels.h"

/* Whether the splat of a voxel of the view's list is projected: not culled by the layer's weight or
 * the plane of the eye. */
bool trip_cpu_is_projected(const trip_cpu_view *view, int u, int v, int sheet);

#endif
