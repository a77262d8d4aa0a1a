/* Where what was kept of a volume lies, coarsely: what mirror.h and footing.h look at to guess how
 * a volume lies whose file does not say so. One thread. */
#ifndef TRIP_OCCUPANCY_H
#define TRIP_OCCUPANCY_H

#include "levels.h"
#include "mean.h"

enum { TRIP_OCCUPANCY_EDGE = 64 }; /* bins along each axis, at most */

/* How much is kept in each bin of a coarse grid, i fastest: values above the volume's least,
 * summed, as parts of the greatest sum, which is 65535. */
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

/* The row along `axis` at place a of the next axis (x after z) and b of the one after that. */
trip_occupancy_row trip_occupancy_along(const trip_occupancy *o, int axis, int a, int b);

typedef struct trip_occupancy_params {
    int64_t dims[3]; /* of level 0 */
    unsigned levels; /* coarse ones that are written */
    bool halo;       /* level 0 has lists of it */
    trip_level_kinds kinds;
    unsigned tile_log2;    /* of the lists' tiles */
    trip_mean_scale scale; /* of the codes of means */
} trip_occupancy_params;

/* Of lists that are complete: reads that of one level along Z, of values if it has them, the first
 * in which some 128 voxels span the grid, or of the coarsest. Takes what it works with from the
 * budget. */
int trip_occupancy_read(trip_occupancy *o, trip_writer *w, const trip_occupancy_params *params,
                        trip_budget *budget);

#endif
