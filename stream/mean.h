/* Codes of means, the records that coarse levels are splatted from. A coarse voxel stands for a
 * cube of voxels of level 0, some of which were kept. Whatever transfer function they meet, their
 * opacity seen along an axis depends on three numbers, which a code of 16 bits has:
 *
 *   bits 6-15  m, the mean of the values kept: that of the code (65535 m + 511) / 1023, rounded
 * down bits 3-5   d, the mean depth: of the columns along the list's axis that hold kept voxels,
 * what part is kept, (d + 1) / 8 bits 0-2   c, the cover: which part of the columns that is, one of
 * trip_mean_covers
 *
 * so that with the extinction k of the mean and the length L of the cube along the axis the opacity
 * is
 *
 *     alpha = cover (1 - exp(-k depth L))
 *
 * which holds both where it is thin, since cover * depth is the part that was kept, and for solids,
 * whose opacity is their cover. Pure functions. */
#ifndef TRIP_MEAN_H
#define TRIP_MEAN_H

#include <stdint.h>

enum { TRIP_MEAN_AXIS_BITS = 6, TRIP_MEAN_SHARES = 1 << TRIP_MEAN_AXIS_BITS };

/* `value`: a code of 16 bits; cover and depth above 0, at most 1. The nearest that there are. */
unsigned trip_mean_pack(unsigned value, double cover, double depth);

/* Of a code's lowest bits, its shares. */
double trip_mean_cover(unsigned shares);
double trip_mean_depth(unsigned shares);

/* The code of 16 bits of the mean value. */
static inline unsigned trip_mean_value(unsigned code)
{
    return ((code >> TRIP_MEAN_AXIS_BITS) * 65535u + 511) / 1023;
}

/* The extinction with which a splat of that shows the cube: k' with 1 - exp(-k' L) = alpha, where
 * the extinction of the mean is k; `length` is L. */
double trip_mean_extinction(unsigned shares, double extinction, double length);

#endif
