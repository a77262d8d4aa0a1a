/* Codes of means, the records that coarse levels are splatted from. A coarse voxel stands for a
 * cube of voxels of level 0, some of which were kept. Whatever transfer function they meet, their
 * opacity seen along an axis depends on three numbers, which a code of 16 bits has:
 *
 *   bits 6-15  m, the mean of the values kept: m / 1023 of the way from the volume's smallest
 *              value to its largest
 *   bits 3-5   d, the mean depth: of the columns along the list's axis that hold kept voxels, what
 *              part is kept, (d + 1) / 8
 *   bits 0-2   c, the cover: which part of the columns that is, 1/64, 1/32, 1/16, 1/8, 1/4,
 *              1/2, 3/4 or 1
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

enum { TRIP_MEAN_AXIS_BITS = 6, TRIP_MEAN_SHARES = 1 << TRIP_MEAN_AXIS_BITS };

/* The codes of level 0, as 16 bits, of the volume's smallest value and how many more its largest
 * has. Codes need not span the range of values: those of 16 bits often take few of their type's. */
typedef struct trip_mean_scale {
    double lo, width;
} trip_mean_scale;

/* `code_lo` and `code_hi`: the values of codes 0 and 65535. */
trip_mean_scale trip_mean_scale_make(double value_min, double value_max, double code_lo,
                                     double code_hi);

/* `value`: a code of level 0; cover and depth above 0, at most 1. The nearest that there are. */
unsigned trip_mean_pack(const trip_mean_scale *scale, double value, double cover, double depth);
/* Its two parts, the bits of the mean and those of the shares. */
unsigned trip_mean_pack_value(const trip_mean_scale *scale, double value);
unsigned trip_mean_pack_shares(double cover, double depth);

/* Of a code's lowest bits, its shares. */
double trip_mean_cover(unsigned shares);
double trip_mean_depth(unsigned shares);

/* The code of level 0 that is nearest to the mean value. */
unsigned trip_mean_value(const trip_mean_scale *scale, unsigned code);

/* The extinction with which a splat of that shows the cube: k' with 1 - exp(-k' L) = alpha, where
 * the extinction of the mean is k; `length` is L. */
double trip_mean_extinction(unsigned shares, double extinction, double length);
/* The same for all shares. */
void trip_mean_extinctions(double extinction, double length, double out[TRIP_MEAN_SHARES]);

#endif
