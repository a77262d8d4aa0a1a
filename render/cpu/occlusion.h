/* Whether anything of a box of voxels can still change a pixel, by which runs are left out before
 * they are projected and bricks before they are read. Any thread may call it while others blend:
 * texels become saturated, and never open again. */
#ifndef TRIP_CPU_OCCLUSION_H
#define TRIP_CPU_OCCLUSION_H

#include <stdatomic.h>

#include "cpu/kernels/kernels.h"

/* Panes across the image and down. */
typedef struct trip_cpu_grid {
    uint32_t across, down;
} trip_cpu_grid;

/* An occlusion map with texels of 4 x 4 pixels, a bit each: 1 where some pixel is open, 0 where all
 * are saturated. Of each pane eight rows of eight, the first row lowest. */
typedef struct trip_cpu_mask {
    trip_cpu_grid grid;
    _Atomic uint64_t *panes;
} trip_cpu_mask;

static inline bool trip_cpu_pane_is_saturated(const trip_cpu_mask *mask, uint32_t pane)
{
    return atomic_load_explicit(&mask->panes[pane], memory_order_relaxed) == 0;
}

/* A box of index space by the list's own coordinates: [u, v, sheet]. */
typedef struct trip_cpu_box {
    double middle[3], half[3];
} trip_cpu_box;

typedef enum trip_cpu_occlusion {
    TRIP_CPU_OCCLUDED, /* no splat of a voxel in the box can change a pixel: every pixel of
                          its support lies in a saturated texel or outside the image */
    TRIP_CPU_PARTLY,   /* parts of the box may be occluded */
    TRIP_CPU_VISIBLE,  /* no texel is saturated there */
} trip_cpu_occlusion;

trip_cpu_occlusion trip_cpu_box_occlusion(const trip_cpu_view *view, const trip_cpu_mask *mask,
                                          const trip_cpu_box *box);

/* Squares of voxels of a sheet, and regions of 8 x 8 squares, a bit of a word each. */
#define TRIP_CPU_SQUARE 8
#define TRIP_CPU_REGION 64
#define TRIP_CPU_REGION_SQUARES 64

/* A screen coordinate of the middles of squares: middle + (by . d) / z, d the square's middle in
 * (u, v) from the region's; and how far from there any support in the square reaches. */
typedef struct trip_cpu_line {
    double middle, by[2], reach;
} trip_cpu_line;

/* Squares of it lie in Morton order, u first. */
typedef struct trip_cpu_region {
    trip_cpu_line x, y;
    double z, z_by[2]; /* depth: z + z_by . d; 1 in parallel views */
} trip_cpu_region;

/* The region whose first voxel is (u, v). TRIP_CPU_OCCLUDED and TRIP_CPU_PARTLY: there are no
 * numbers for it, it is behind the eye or may be anywhere. */
trip_cpu_occlusion trip_cpu_region_make(const trip_cpu_view *view, int u, int v, int64_t sheet,
                                        trip_cpu_region *region);

/* The voxels of a brick of the view's list; `sheets` as a range cuts it, inclusive. */
trip_cpu_box trip_cpu_brick_box(const trip_cpu_view *view, uint64_t brick, int64_t first_sheet,
                                int64_t last_sheet);

#endif
