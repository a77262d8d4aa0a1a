/* The voxels of coarse levels, each made of the 2 x 2 x 2 of the level below. Pure functions. */
#ifndef TRIP_COARSE_H
#define TRIP_COARSE_H

#include <stdbool.h>
#include <stdint.h>

enum { TRIP_COARSE_ALL = 65535 };

/* A voxel of any level. Parts and shares are in 65535ths. */
typedef struct trip_coarse_voxel {
    uint8_t u, v;      /* in its square of the sheet, along x and y */
    uint16_t kept;     /* the part of its voxels of level 0 that were kept; 0: none */
    uint16_t known;    /* that have a value: kept ones and halo */
    uint16_t mean;     /* code of those kept */
    uint16_t value;    /* of those known */
    uint16_t cover[3]; /* of its columns along an axis, those with kept voxels */
    uint32_t normal;   /* packed: of those kept, see below */
} trip_coarse_voxel;

/* Sums over the voxels of one coarse voxel; all zero before the first but for `open`. */
typedef struct trip_coarse_sum {
    float kept, known, mean, value;
    float gradient[3], steep; /* each times its length; sum of the lengths */
    uint8_t open[3][4]; /* of the columns along an axis, in 255ths, the part without kept voxels */
} trip_coarse_sum;

void trip_coarse_sum_clear(trip_coarse_sum *s);

/* Adds a voxel whose coordinates are odd as the bits 0 to 2 of `odd` say; `gradient` NULL: without
 * one. The sign of gradients may be lost (normal.h): they are turned to point the same way. */
void trip_coarse_sum_add(trip_coarse_sum *s, const trip_coarse_voxel *voxel, unsigned odd,
                         const double gradient[3]);

/* The same of a voxel of level 0, which has a value, and was kept or is of the halo. */
void trip_coarse_sum_add_whole(trip_coarse_sum *s, uint16_t code, bool kept, unsigned odd,
                               const double gradient[3]);

/* Without u, v and normal; false where there was nothing to add up. */
bool trip_coarse_sum_get(const trip_coarse_sum *s, trip_coarse_voxel *out);

/* The mean gradient of what was kept, each counted by its length. */
void trip_coarse_sum_gradient(const trip_coarse_sum *s, double gradient[3]);

#endif
