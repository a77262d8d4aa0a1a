/* Gradients of a volume's values by central differences, one-sided where only one neighbour is
 * there. Pure functions. */
#ifndef TRIP_GRADIENT_H
#define TRIP_GRADIENT_H

#include <math.h>

#include "volume.h"

/* What the difference of both neighbours along an axis is multiplied by: 1/2, or 1 at a border,
 * beyond which the voxel itself is repeated, so that the difference is one-sided. */
static inline double trip_gradient_share(bool at_border)
{
    return at_border ? 1 : 0.5;
}

/* The second half of trip_gradient_at(), where a difference is not finite. */
void trip_gradient_careful(const float *value, const int64_t step[3], const double share[3],
                           double gradient[3]);

/* The gradient in index space, value units per index, at a voxel whose neighbours along axis a are
 * at value[step[a]] and value[-step[a]], with trip_gradient_share() of each axis. Where one
 * neighbour is not finite the difference is that to the other; without either it is 0. */
static inline void trip_gradient_at(const float *value, const int64_t step[3],
                                    const double share[3], double gradient[3])
{
    for (int a = 0; a < 3; a++)
        gradient[a] = share[a] * ((double)value[step[a]] - (double)value[-step[a]]);
    if (!isfinite(gradient[0] + gradient[1] + gradient[2]))
        trip_gradient_careful(value, step, share, gradient);
}

/* A power of two near the length of a voxel. Gradients that are kept as floats until the range of
 * the values is known are in value units per this length, so that no world unit takes them out of
 * the range of a float. */
double trip_gradient_unit(const trip_affine *index_to_world);

#endif
