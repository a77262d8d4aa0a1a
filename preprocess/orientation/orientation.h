/* Guesses the orientation of a volume from its kept part, if the file gives none. One thread. */
#ifndef TRIP_ORIENTATION_H
#define TRIP_ORIENTATION_H

#include "occupancy.h"

typedef struct trip_orientation {
    int mirror;  /* the only axis across which the volume is mirror-symmetric; -1 if none */
    int footing; /* side on which it stands, as in trip_orientation_base_side(); -1 if none */
} trip_orientation;

/* Guesses the orientation from the lists of the data set, which must be complete. Takes its working
 * memory from the budget. */
int trip_orientation_find(trip_orientation *u, trip_writer *w, const trip_occupancy_params *params,
                          trip_budget *budget);

/* ---- symmetry ----
 *
 * Most objects with a left and a right side are mirror-symmetric across one axis of their grid and
 * not across the others: heads, teapots, animals. */

/* Returns how closely the bins match their mirror image across a plane at right angles to `axis`.
 * The score is sum(w * mirrored w) / sum(w^2) over the bins, for the best position of the plane. An
 * exact mirror image scores 1, bins without weight score 0. Sums are integers, so their order does
 * not matter. */
double trip_orientation_symmetry_score(const trip_occupancy *o, int axis);

/* Returns the axis with a strong symmetry if the symmetry across both other axes is much weaker,
 * else -1. A ball, a box or a cylinder has no such axis. */
int trip_orientation_symmetry_axis(const double scores[3]);

/* ---- base ----
 *
 * Statues on plinths, teapots and clouds with flat bases have one level side and uneven other
 * sides. */

enum { TRIP_ORIENTATION_BASE_LOW_Y = 2, TRIP_ORIENTATION_BASE_LOW_Z = 4 };

/* Returns how level a side is. Sides are numbered -x, +x, -y, +y, -z, +z. Counts the rows of bins
 * that cross the object along the side's axis. Returns the fraction of the rows that reach into the
 * tenth of the object's extent nearest to the side. The fraction is 1 for a box, and 0 if no bin
 * has weight. */
double trip_orientation_base_share(const trip_occupancy *o, int side);

/* Returns the level side, or -1 if none is level enough. The share of every other side must be at
 * most half as large. A box or a ball has no such side. */
int trip_orientation_base_side(const double shares[6]);

/* Returns the name of a side, "-x" to "+z". */
const char *trip_orientation_base_name(int side);

#endif
