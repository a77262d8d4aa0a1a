/* Image-aligned sheet buffers (Mueller & Crawfis 1998, "Eliminating popping artifacts in sheet
 * buffer-based splatting"), to compare the papers' three lists with: slabs between planes of equal
 * depth, a voxel thick, each of which takes the part of every splat that lies in it. The reference
 * renderer's.
 *
 * Slab n lies at the depths from n d to (n + 1) d, d being the depth of a voxel's length along the
 * direction of view. Of a splat's optical depth at a pixel (splat.h, without front(p)) slab n takes
 *     F((n + 1) d) - F(n d),   F(z) = 1/2 (1 + erf(s / sqrt 2) / erf(k / sqrt 2)),  |s| <= k,
 * s being the distance along the ray, in standard deviations, from where it passes nearest to the
 * voxel to depth z; below F is 0, above 1. A slab's parts are summed, as those of a sheet are
 * (splat.h), and slabs composited front to back, so that no order of splats matters. */
#ifndef TRIP_IMAGE_SHEETS_H
#define TRIP_IMAGE_SHEETS_H

#include "budget.h"
#include "layer.h"
#include "splat.h"

typedef struct trip_image_sheets trip_image_sheets;

/* Of a grid of so many voxels; takes, for each pixel and slab, a double per channel of a layer. */
int trip_image_sheets_create(trip_image_sheets **out, const trip_camera *camera,
                             const trip_settings *settings, const uint64_t dims[3],
                             trip_budget *budget);
void trip_image_sheets_destroy(trip_image_sheets *s);

/* Adds a splat's optical depth at the centre of pixel (x, y), in which it has these channels. */
void trip_image_sheets_add(trip_image_sheets *s, const trip_splat_frame *f, trip_vec3 voxel, int x,
                           int y, const double fragment[TRIP_CHANNELS_MAX], double depth);

/* How many there are, and the sums of a pixel's n-th from the eye: of optical depth times each
 * channel. */
int trip_image_sheets_count(const trip_image_sheets *s);
const double *trip_image_sheets_at(const trip_image_sheets *s, int x, int y, int n);

#endif
