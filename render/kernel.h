/* Weights of the kernels by which values are interpolated between voxels, along one axis. Pure. */
#ifndef TRIP_KERNEL_H
#define TRIP_KERNEL_H

#include "settings.h"

/* Voxels along each axis that have weight at most: one before the cell of the place, its two, and
 * one behind. */
enum { TRIP_KERNEL_TAPS = 4 };

/* Those of the voxels at -1, 0, 1 and 2 at a place from 0 to 1; they add up to 1.
 * linear: of 0 and 1 alone. cubic: Catmull and Rom's spline. gaussian: of distances d,
 *     exp(-d^2 / (2 sigma^2)) - exp(-TRIP_CUTOFF^2 / 2), at least 0, over their sum,
 * sigma = 2 / TRIP_CUTOFF: the profile of a splat of radius 2, which smooths. */
void trip_kernel_weights(trip_kernel kernel, double position, double weights[TRIP_KERNEL_TAPS]);

/* How far in indices, along each axis, a voxel has weight. */
static inline int trip_kernel_reach(trip_kernel kernel)
{
    return kernel == TRIP_KERNEL_LINEAR ? 1 : 2;
}

/* "linear", "cubic", "gaussian". */
const char *trip_kernel_name(trip_kernel kernel);

#endif
