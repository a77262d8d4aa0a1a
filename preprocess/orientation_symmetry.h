/* Whether what was kept of a volume is mirror-symmetric across one axis of its grid and not across
 * the others, as nearly everything with a left and a right is: heads, teapots, animals. Pure
 * functions. */
#ifndef TRIP_ORIENTATION_SYMMETRY_H
#define TRIP_ORIENTATION_SYMMETRY_H

#include "occupancy.h"

/* By how much the bins are their own mirror image across the plane at right angles to `axis` for
 * which this is most: the sum over the bins of w times w of the mirrored bin, of the sum of w
 * squared; 1 for an exact mirror image, 0 for bins without weight. Whole numbers are summed, so
 * that no order counts. */
double trip_orientation_symmetry_score(const trip_occupancy *o, int axis);

/* The axis across which the symmetry is strong, when it is much weaker across both others; else
 * -1. A ball, a box or a cylinder has none. */
int trip_orientation_symmetry_axis(const double scores[3]);

#endif
