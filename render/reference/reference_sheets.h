/* Draws `post` frames for the reference renderer, which owns it: sheet.h in double precision, pixel
 * by pixel. The voxels of all passes go into one field for all layers. A voxel that the plan leaves
 * out of a layer cannot change that layer, so it may be present for another. One thread. */
#ifndef TRIP_REFERENCE_SHEETS_H
#define TRIP_REFERENCE_SHEETS_H

#include "layer.h"
#include "renderer.h"
#include "splat.h"

typedef struct trip_reference_sheets trip_reference_sheets;

int trip_reference_sheets_create(trip_reference_sheets **out, const trip_frame *frame,
                                 trip_budget *budget);
void trip_reference_sheets_destroy(trip_reference_sheets *s);

int trip_reference_sheets_put(trip_reference_sheets *s, const trip_batch *batch,
                              const trip_run *run);

/* Prepares the voxels put so far. Call it before trip_reference_sheets_layer(). Fails (reported) if
 * memory is exhausted or the frame is interrupted. */
int trip_reference_sheets_prepare(trip_reference_sheets *s);
/* Computes the layer of `axis` at the centre of pixel (x, y). The layer must have weight there.
 * Depths are distances. */
void trip_reference_sheets_layer(const trip_reference_sheets *s, int axis, int x, int y,
                                 double layer[TRIP_CHANNELS_MAX]);

/* ---- image_sheets.c ----
 *
 * Image-aligned sheet buffers (Mueller & Crawfis 1998, "Eliminating popping artifacts in sheet
 * buffer-based splatting"), to compare with the three lists of the papers. Slabs lie between planes
 * of equal depth, one voxel apart. Each slab takes the parts of splats inside it. The reference
 * renderer owns them.
 *
 * Slab n covers the depths from n d to (n + 1) d. d is the depth of one voxel length along the view
 * direction. Slab n takes this share of a splat's optical depth at a pixel (splat.h, without
 * front(p)):
 *     F((n + 1) d) - F(n d),   F(z) = 1/2 (1 + erf(s / sqrt 2) / erf(k / sqrt 2)),  |s| <= k.
 * s is the distance along the ray from the point nearest to the voxel to depth z, in standard
 * deviations. F is 0 for smaller s and 1 for larger s. The parts in a slab are added, like the
 * splats of a sheet (splat.h). Slabs are composited front to back, so the order of splats does not
 * matter. */

typedef struct trip_image_sheets trip_image_sheets;

/* Creates the slabs for a grid of `dims` voxels. They take a double per pixel, slab and channel of
 * a layer. */
int trip_image_sheets_create(trip_image_sheets **out, const trip_camera *camera,
                             const trip_settings *settings, const uint64_t dims[3],
                             trip_budget *budget);
void trip_image_sheets_destroy(trip_image_sheets *s);

/* Adds a splat's optical depth and channels at the centre of pixel (x, y). */
void trip_image_sheets_add(trip_image_sheets *s, const trip_splat_frame *f, trip_vec3 voxel, int x,
                           int y, const double fragment[TRIP_CHANNELS_MAX], double depth);

/* Return the number of slabs, and the sums of a pixel in slab n from the eye: optical depth times
 * each channel. */
int trip_image_sheets_count(const trip_image_sheets *s);
const double *trip_image_sheets_at(const trip_image_sheets *s, int x, int y, int n);

#endif
