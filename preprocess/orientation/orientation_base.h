/* Guesses on which side of its grid the kept part of a volume stands. Statues on plinths, teapots
 * and clouds with flat bases have one level side and uneven other sides. Pure functions. */
#ifndef TRIP_ORIENTATION_BASE_H
#define TRIP_ORIENTATION_BASE_H

#include "occupancy.h"

enum { TRIP_ORIENTATION_BASE_LOW_Z = 4 };

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
