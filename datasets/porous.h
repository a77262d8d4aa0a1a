/* A scan of a porous solid, as a CT scanner sees it: solid, pores, boundaries one voxel wide, and
 * noise. The solid is where a sum of 24 plane waves exceeds a threshold (Berk, Scattering
 * properties of a model bicontinuous structure, 1987). The sum is nearly Gaussian. Its
 * threshold thus determines the share of the solid. Pure functions. */
#ifndef TRIP_POROUS_H
#define TRIP_POROUS_H

enum {
    TRIP_POROUS_SOLID = 32000, /* values of the phases, and standard deviation of the noise */
    TRIP_POROUS_PORE = 12000,
    TRIP_POROUS_NOISE = 900,
    TRIP_POROUS_MAX = 65535,
};

/* Computes `count` values of a row along X, from the voxel (x, y, z) on. Values lie in [0,
 * TRIP_POROUS_MAX]. The result does not depend on how a row is divided into calls.
 * `detail` divides the width of the structure: 1 gives waves of about 43 voxels in a volume with a
 * longest side of 256. */
void trip_porous_row(const long dims[3], double detail, long x, long y, long z, long count,
                     float *values);

#endif
