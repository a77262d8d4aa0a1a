/* Tests whether the kept part of a volume is mirror-symmetric across one axis of its grid and not
 * across the others. Most objects with a left and a right side are: heads, teapots, animals. Pure
 * functions. */
#ifndef TRIP_ORIENTATION_SYMMETRY_H
#define TRIP_ORIENTATION_SYMMETRY_H

#include "occupancy.h"

/* Returns how closely the bins match their mirror image across a plane at right angles to `axis`.
 * The score is sum(w * mirrored w) / sum(w^2) over the bins, for the best position of the plane. An
 * exact mirror image scores 1, bins without weight score 0. Sums are integers, so their order does
 * not matter. */
double trip_orientation_symmetry_score(const trip_occupancy *o, int axis);

/* Returns the axis with a strong symmetry if the symmetry across both other axes is much weaker,
 * else -1. A ball, a box or a cylinder has no such axis. */
int trip_orientation_symmetry_axis(const double scores[3]);

#endif
