/* Gradients of a volume by central differences, or one-sided ones if a neighbour is missing. Pure
 * functions. */
#ifndef TRIP_GRADIENT_H
#define TRIP_GRADIENT_H

#include <math.h>

#include "volume_info.h"

/* Returns the factor of the difference of both neighbours along an axis: 1/2, or 1 at a border.
 * Beyond a border the voxel itself is repeated, which makes the difference one-sided. */
static inline double trip_gradient_share(bool at_border)
{
    return at_border ? 1 : 0.5;
}

/* Slow path of trip_gradient_at(), for differences that are not finite. */
void trip_gradient_careful(const float *value, const int64_t step[3], const double share[3],
                           double gradient[3]);

/* Returns the gradient in index space, value units per index. The voxel's neighbours along axis a
 * are value[step[a]] and value[-step[a]]; share[a] is trip_gradient_share(). If one neighbour is
 * not finite, the difference is one-sided; if both are not, it is 0. */
static inline void trip_gradient_at(const float *value, const int64_t step[3],
                                    const double share[3], double gradient[3])
{
    for (int a = 0; a < 3; a++)
        gradient[a] = share[a] * ((double)value[step[a]] - (double)value[-step[a]]);
    if (!isfinite(gradient[0] + gradient[1] + gradient[2]))
        trip_gradient_careful(value, step, share, gradient);
}

/* Returns a power of two near the length of a voxel. Until the range of values is known, gradients
 * are floats in value units per this length. This keeps them in the range of a float, whatever the
 * world unit. */
double trip_gradient_unit(const trip_affine *index_to_world);

#endif
