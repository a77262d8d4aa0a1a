/* Morphological dilation by the 26 neighbours. It finds the halo, which interpolation needs at the
 * border of the kept voxels. Pure functions. */
#ifndef TRIP_DILATE_H
#define TRIP_DILATE_H

#include <stdint.h>

/* Dilates the flags (0 or 1) of a dense box, x fastest. `out` is 1 if the voxel or a neighbour
 * inside the box is set, else 0. `scratch` has the same size. */
void trip_dilate(const uint8_t *flags, uint8_t *out, uint8_t *scratch, const int64_t size[3]);

#endif
