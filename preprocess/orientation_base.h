/* On which side of its grid what was kept of a volume stands: statues on their plinths, teapots on
 * their bottoms, and clouds, whose bases are flat, show one level side where all others are uneven.
 * Pure functions. */
#ifndef TRIP_ORIENTATION_BASE_H
#define TRIP_ORIENTATION_BASE_H

#include "occupancy.h"

enum { TRIP_ORIENTATION_BASE_LOW_Z = 4 };

/* Sides are numbered -x, +x, -y, +y, -z, +z. How level one is: of the rows of bins that cross the
 * object along the side's axis, the part that reaches into the tenth of the object's extent which
 * is nearest the side. 1 for a box, 0 for bins without weight. */
double trip_orientation_base_share(const trip_occupancy *o, int side);

/* The side that is level when no other is half as much so; else -1. A box or a ball has none. */
int trip_orientation_base_side(const double shares[6]);

/* "-x" ... "+z". */
const char *trip_orientation_base_name(int side);

#endif
