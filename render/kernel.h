/* Weights of the interpolation kernels along one axis. Pure functions. */
#ifndef TRIP_KERNEL_H
#define TRIP_KERNEL_H

#include "settings.h"

/* Maximum number of voxels with weight along an axis: the cell's two, one before and one behind. */
enum { TRIP_KERNEL_TAPS = 4 };

/* Computes the weights of the voxels at -1, 0, 1 and 2 for a position from 0 to 1. They add up
 * to 1.
 * - linear uses voxels 0 and 1.
 * - nearest uses the closer one of voxels 0 and 1, and voxel 1 half-way.
 * - cubic is the Catmull-Rom spline.
 * - gaussian smooths with the profile of a splat of radius 2: weights max(0, exp(-d^2 /
 *   (2 sigma^2)) - exp(-TRIP_CUTOFF^2 / 2)) of the distances d, divided by their sum, with sigma =
 *   2 / TRIP_CUTOFF. */
void trip_kernel_weights(trip_kernel kernel, double position, double weights[TRIP_KERNEL_TAPS]);

/* Whether the kernel interpolates between 64 voxels instead of the 8 corners of a cell. */
static inline bool trip_kernel_is_wide(trip_kernel kernel)
{
    return kernel == TRIP_KERNEL_CUBIC || kernel == TRIP_KERNEL_GAUSSIAN;
}

/* Returns the reach of a voxel along each axis, in indices. */
static inline int trip_kernel_reach(trip_kernel kernel)
{
    return trip_kernel_is_wide(kernel) ? 2 : 1;
}

/* Returns "linear", "cubic", "gaussian" or "nearest". */
const char *trip_kernel_name(trip_kernel kernel);

#endif
