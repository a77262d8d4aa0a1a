/* A coarse map of the kept part of a volume. orientation.h uses it to guess the orientation of a
 * volume if its file gives none. One thread. */
#ifndef TRIP_OCCUPANCY_H
#define TRIP_OCCUPANCY_H

#include "levels.h"
#include "mean.h"

enum { TRIP_OCCUPANCY_EDGE = 64 }; /* maximum number of bins along each axis */

/* The weight of each bin of a coarse grid, i fastest. A weight sums the kept values above the
 * minimum of the typical range. Weights are scaled so that the greatest is 65535. */
typedef struct trip_occupancy {
    int dims[3]; /* 1 to TRIP_OCCUPANCY_EDGE */
    uint16_t weights[TRIP_OCCUPANCY_EDGE * TRIP_OCCUPANCY_EDGE * TRIP_OCCUPANCY_EDGE];
} trip_occupancy;

/* A row of bins along an axis. */
typedef struct trip_occupancy_row {
    const uint16_t *first;
    size_t step;
    int bins;
} trip_occupancy_row;

/* Returns the row along `axis` at index a of the next axis (x follows z) and index b of the axis
 * after that. */
trip_occupancy_row trip_occupancy_along(const trip_occupancy *o, int axis, int a, int b);

typedef struct trip_occupancy_params {
    int64_t dims[3]; /* of level 0 */
    unsigned levels; /* number of coarse levels written */
    bool halo;       /* level 0 has lists of halo voxels */
    trip_level_kinds kinds;
    unsigned tile_log2; /* tiles have an edge of 1 << tile_log2 voxels */
    trip_codes codes;
    double typical_min, typical_max; /* typical range of the volume's values */
} trip_occupancy_params;

/* Fills `o` from one Z list of the data set. All lists must be complete.
 * - The level is the first with at most 128 voxels along each axis, or else the coarsest.
 * - A level with lists of values and of means is read from its list of values.
 *
 * Takes its working memory from the budget. */
int trip_occupancy_read(trip_occupancy *o, trip_writer *w, const trip_occupancy_params *params,
                        trip_budget *budget);

#endif
