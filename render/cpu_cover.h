/* Whether anything of a box of voxels can still show: asked before runs are projected and bricks
 * are read. Any thread may ask while others blend; tiles only ever close. */
#ifndef TRIP_CPU_COVER_H
#define TRIP_CPU_COVER_H

#include <stdatomic.h>

#include "cpu_bin.h"
#include "cpu_kernels.h"

/* A box of index space by the list's own coordinates: [u, v, sheet]. */
typedef struct trip_cpu_box {
    double lo[3], hi[3];
} trip_cpu_box;

/* True only when no splat of a voxel in the box can change a pixel: every pixel of its support lies
 * in a closed tile or outside the image. */
bool trip_cpu_box_is_hidden(const trip_cpu_view *view, trip_cpu_grid grid,
                            const _Atomic uint8_t *closed, const trip_cpu_box *box);

/* The voxels of a brick of the view's list; `sheets` as a range cuts it, inclusive. */
trip_cpu_box trip_cpu_brick_box(const trip_cpu_view *view, uint64_t brick, int64_t first_sheet,
                                int64_t last_sheet);

/* True only when no pixel of the tile at (x, y) has weight in the view's list. */
bool trip_cpu_tile_without_weight(const trip_cpu_view *view, int x, int y);

#endif
