/* Tests whether a box of voxels can still change a pixel. The result lets the renderer skip runs
 * before projection and bricks before reading. Any thread may call these functions while others
 * blend, because a terminated texel never opens again in a layer. */
#ifndef TRIP_CPU_OCCLUSION_H
#define TRIP_CPU_OCCLUSION_H

#include <stdatomic.h>

#include "cpu/kernels/kernels.h"

/* Number of panes across the image and down. `first` panes lie above the drawn rows. */
typedef struct trip_cpu_grid {
    uint32_t across, down, first;
} trip_cpu_grid;

/* An occlusion map with one bit for each texel of 4 x 4 pixels. The bit is 1 if a pixel is open and
 * 0 if all are terminated. A pane has eight rows of eight texels; the first row is in the lowest
 * byte. */
typedef struct trip_cpu_mask {
    trip_cpu_grid grid;
    _Atomic uint64_t *panes;
} trip_cpu_mask;

static inline bool trip_cpu_pane_is_terminated(const trip_cpu_mask *mask, uint32_t pane)
{
    return atomic_load_explicit(&mask->panes[pane], memory_order_relaxed) == 0;
}

/* A box in the list's index space. Coordinates are in the order [u, v, sheet]. */
typedef struct trip_cpu_box {
    double middle[3], half[3];
} trip_cpu_box;

typedef enum trip_cpu_occlusion {
    TRIP_CPU_OCCLUDED, /* no splat of the box can change a pixel: all pixels of its support are in
                          terminated texels or outside the image */
    TRIP_CPU_PARTLY,   /* parts of the box may be occluded */
    TRIP_CPU_VISIBLE,  /* no texel of the box's outline is terminated */
} trip_cpu_occlusion;

trip_cpu_occlusion trip_cpu_box_occlusion(const trip_cpu_view *view, const trip_cpu_mask *mask,
                                          const trip_cpu_box *box);

/* Edge in voxels of a square and of a region, and the number of squares in a region. A word stores
 * one bit for each square of a region. */
#define TRIP_CPU_SQUARE 8
#define TRIP_CPU_REGION 64
#define TRIP_CPU_REGION_SQUARES 64

/* A screen coordinate of a square's middle is middle + (by . d) / z. d is the square's middle in
 * (u, v), relative to the region's middle. `reach` bounds the distance from there to the edge of
 * any support in the square. All in pixels. */
typedef struct trip_cpu_line {
    double middle, by[2], reach;
} trip_cpu_line;

/* A region of 8 x 8 squares in Morton order, u first. */
typedef struct trip_cpu_region {
    trip_cpu_line x, y;
    double z, z_by[2]; /* depth z + z_by . d; always 1 in parallel views */
} trip_cpu_region;

/* Makes the region with first voxel (u, v) and returns TRIP_CPU_VISIBLE. Leaves *region unset
 * otherwise: TRIP_CPU_OCCLUDED means the region lies behind the eye, TRIP_CPU_PARTLY that it cannot
 * be bounded. */
trip_cpu_occlusion trip_cpu_region_make(const trip_cpu_view *view, int u, int v, int64_t sheet,
                                        trip_cpu_region *region);

/* Returns the box of a brick of a list, cut to the sheets from first_sheet to last_sheet,
 * inclusive. */
trip_cpu_box trip_cpu_brick_box(const trip_dataset *data, const trip_list *list, uint64_t brick,
                                int64_t first_sheet, int64_t last_sheet);

#endif
