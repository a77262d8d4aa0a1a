/* Codes of deviations, one byte each. A coarse value is the mean of voxels of level 0. Its
 * deviation is their standard deviation about the mean, in 16-bit codes:
 *
 *     deviation(d) = 32767.5 (d / 255)^2
 *
 * 32767.5 is the largest deviation that codes can have. Steps are fine where deviations are small.
 * Pure functions. */
#ifndef TRIP_DEVIATION_H
#define TRIP_DEVIATION_H

#include <math.h>

enum { TRIP_DEVIATION_MAX = 255 };

/* Returns the deviation of d, which need not be whole. */
static inline double trip_deviation(double d)
{
    const double part = d / TRIP_DEVIATION_MAX;
    return 32767.5 * part * part;
}

/* Returns the nearest d for a variance. */
static inline unsigned trip_deviation_pack(double variance)
{
    const double d = TRIP_DEVIATION_MAX * sqrt(sqrt(variance > 0 ? variance : 0) / 32767.5) + 0.5;
    return d < TRIP_DEVIATION_MAX ? (unsigned)d : TRIP_DEVIATION_MAX;
}

#endif
