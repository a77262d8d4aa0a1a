/* Codes of means, the records of coarse levels drawn as splats. A coarse voxel stands for a cube of
 * voxels of level 0, some of which were kept. For any transfer function, its opacity along an axis
 * depends on three numbers, which are stored in a 16-bit code:
 *
 *   bits 6-15  m, the mean of the kept values: m / 1023 of the way from the code of the typical
 *              minimum to the code of the typical maximum
 *   bits 3-5   d, the mean depth: in the columns along the list's axis that hold kept voxels, the
 *              fraction that is kept, (d + 1) / 8
 *   bits 0-2   c, the cover: the fraction of columns that hold kept voxels, 1/64, 1/32, 1/16, 1/8,
 *              1/4, 1/2, 3/4 or 1
 *
 * With the extinction k of the mean and the length L of the cube along the axis, the opacity is
 *
 *     alpha = cover (1 - exp(-k depth L))
 *
 * This holds for thin matter, since cover * depth is the fraction that was kept. It also holds for
 * solids, which have an opacity equal to their cover. Pure functions. */
#ifndef TRIP_MEAN_H
#define TRIP_MEAN_H

#include "codes.h"

enum { TRIP_MEAN_AXIS_BITS = 6, TRIP_MEAN_SHARES = 1 << TRIP_MEAN_AXIS_BITS };

/* The minimum of the volume as a 16-bit code of level 0, and the difference to the maximum. Codes
 * need not span the range of values: 16-bit values often use a small part of the range of their
 * type. */
typedef struct trip_mean_scale {
    double lo, width;
} trip_mean_scale;

trip_mean_scale trip_mean_scale_make(double value_min, double value_max, const trip_codes *codes);

/* Packs the nearest code. `value` is a code of level 0. Cover and depth are above 0 and at most 1.
 */
unsigned trip_mean_pack(const trip_mean_scale *scale, double value, double cover, double depth);
/* Return the two parts of such a code: the bits of the mean, and the bits of the shares. */
unsigned trip_mean_pack_value(const trip_mean_scale *scale, double value);
unsigned trip_mean_pack_shares(double cover, double depth);

/* Return cover and depth from the shares, the lowest bits of a code. */
double trip_mean_cover(unsigned shares);
double trip_mean_depth(unsigned shares);

/* Returns the code of level 0 nearest to the mean value. */
unsigned trip_mean_value(const trip_mean_scale *scale, unsigned code);

/* Returns the extinction k' of a splat that represents the cube, with 1 - exp(-k' L) = alpha.
 * `extinction` is k, the extinction of the mean value; `length` is L. */
double trip_mean_extinction(unsigned shares, double extinction, double length);
/* Computes trip_mean_extinction() for all shares. */
void trip_mean_extinctions(double extinction, double length, double out[TRIP_MEAN_SHARES]);

#endif
