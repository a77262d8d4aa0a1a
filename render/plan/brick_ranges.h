/* The range of draw codes in all cells that a brick's voxels touch (sheet.h). It covers the brick
 * and its neighbours, in all lists of voxels and halo along an axis. If their deviations blur the
 * transfer function, the range also covers all codes that these reach. The plan owns it. */
#ifndef TRIP_BRICK_RANGES_H
#define TRIP_BRICK_RANGES_H

#include "code_set.h"
#include "dataset.h"
#include "draw_codes.h"
#include "sheet.h"

/* Maximum number of slabs that the voxels around a brick lie in. It is reached with slabs of one
 * sheet. */
enum { TRIP_BRICK_RANGES_SLABS = 2 * TRIP_SHEET_REACH_MAX + 1 };

/* The tiles of a few consecutive slabs. */
typedef struct trip_brick_ranges {
    const trip_dataset *data;
    const trip_draw_codes *draw;
    int axis;
    trip_kernel kernel;
    int64_t first_u, first_v, across, down;          /* tiles with bricks, plus one on every side */
    int reach, slabs;                                /* slabs on each side, and in all */
    trip_code_range *tiles[TRIP_BRICK_RANGES_SLABS]; /* [i] is slab middle - reach + i */
    uint8_t *deviations[TRIP_BRICK_RANGES_SLABS];    /* maxima; NULL if nothing is blurred */
    int64_t middle;
    trip_budget *budget;
    size_t bytes;
} trip_brick_ranges;

/* Prepares the ranges of the level 0 lists along an axis. If memory is too short or tiles are too
 * far apart, every range covers all codes. */
void trip_brick_ranges_create(trip_brick_ranges *r, const trip_dataset *data,
                              const trip_draw_codes *draw, int axis, trip_kernel kernel, bool blurs,
                              trip_budget *budget);
void trip_brick_ranges_destroy(trip_brick_ranges *r);

/* Returns the range of a brick and its neighbours. Fast if called slab after slab. */
trip_code_range trip_brick_ranges_about(trip_brick_ranges *r, uint32_t slab,
                                        const trip_file_brick *brick);

/* Widens a range of draw codes by the reach of deviation codes up to d. */
trip_code_range trip_brick_range_blurred(trip_kernel kernel, const trip_draw_codes *draw,
                                         trip_code_range range, unsigned d);

#endif
