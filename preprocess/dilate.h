/* Morphological dilation of a set of voxels by their 26 neighbours, which interpolation needs at
 * the border of what is kept. Pure functions. */
#ifndef TRIP_DILATE_H
#define TRIP_DILATE_H

#include <stdint.h>

/* Flags of a box, 0 or 1, dense, x fastest: entries of `out` become 1 where the voxel or a
 * neighbour inside the box has its flag set, else 0. `scratch` is as large as they are. */
void trip_dilate(const uint8_t *flags, uint8_t *out, uint8_t *scratch, const int64_t size[3]);

#endif
