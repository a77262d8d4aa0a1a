/* The codes that cells may lie between which a brick's voxels change (sheet.h): of those of the
 * brick and of the bricks about it, of all lists of voxels and halo along an axis. A part of the
 * plan; owned by it. */
#ifndef TRIP_BRICK_RANGES_H
#define TRIP_BRICK_RANGES_H

#include "code_set.h"
#include "dataset.h"
#include "sheet.h"

/* Slabs on each side that a voxel may reach into: those of one sheet, into two. */
enum { TRIP_BRICK_RANGES_SLABS = 2 * TRIP_SHEET_REACH_MAX + 1 };

/* Tiles of a few slabs in a row. */
typedef struct trip_brick_ranges {
    const trip_dataset *data;
    int axis;
    trip_kernel kernel;
    int64_t first_u, first_v, across, down; /* tiles with bricks, and one more on every side */
    int reach, slabs;                       /* on each side; in all */
    trip_code_range *tiles[TRIP_BRICK_RANGES_SLABS]; /* of slabs from middle - reach on */
    int64_t middle;
    trip_budget *budget;
    size_t bytes;
} trip_brick_ranges;

/* Of the lists along an axis at level 0. Without memory for it, or with tiles too far apart, any
 * range is taken to hold all codes. */
void trip_brick_ranges_create(trip_brick_ranges *r, const trip_dataset *data, int axis,
                              trip_kernel kernel, trip_budget *budget);
void trip_brick_ranges_destroy(trip_brick_ranges *r);

/* Of a brick and those about it. Fast where slabs are gone through in order. */
trip_code_range trip_brick_ranges_about(trip_brick_ranges *r, uint32_t slab,
                                        const trip_file_brick *brick);

#endif
