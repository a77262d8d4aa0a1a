/* The bricks of the slab that a list is being written to. They are collected run by run, sheet by
 * sheet, and returned in Morton order of their tiles. Used by the writer; one thread per slab. */
#ifndef TRIP_SLAB_H
#define TRIP_SLAB_H

#include "budget.h"
#include "format.h"

typedef struct trip_slab_brick {
    uint64_t tile; /* Morton code */
    trip_file_brick brick;
} trip_slab_brick;

typedef struct trip_slab {
    trip_budget *budget;
    unsigned sheets;
    /* `merged` bricks belong to the sheets before and are in order. */
    size_t brick_count, merged, cursor, room;
    trip_slab_brick *bricks;
    trip_slab_brick *bricks_spare; /* target of the next merge */
    trip_file_run *runs;           /* [brick][sheet] */
    trip_file_run *runs_spare;
} trip_slab;

void trip_slab_init(trip_slab *s, unsigned sheets, trip_budget *budget);
void trip_slab_free(trip_slab *s);
/* Adds a run. Runs of a sheet come by ascending tile. Call trip_slab_end_sheet() after the last run
 * of each sheet. `words` is the length of the run's block. `deviations` is NULL if the list has
 * none. Returns the run's brick, or NULL after a reported failure. */
const trip_file_brick *trip_slab_add(trip_slab *s, unsigned sheet, uint32_t tile_u, uint32_t tile_v,
                                     const uint32_t *voxels, const uint32_t *deviations,
                                     uint32_t count, uint32_t words);
void trip_slab_end_sheet(trip_slab *s);
void trip_slab_clear(trip_slab *s);

#endif
