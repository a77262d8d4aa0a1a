/* The bricks of the slab a list is being written in: gathered run by run, sheet after sheet, given
 * out in Morton order of their tiles. Used by the writer; one thread per slab. */
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
    size_t brick_count, merged, cursor, room; /* merged: those of the sheets before, in order */
    trip_slab_brick *bricks;
    trip_slab_brick *bricks_spare; /* the other half of each merge */
    trip_file_run *runs;           /* [brick][sheet] */
    trip_file_run *runs_spare;
} trip_slab;

void trip_slab_init(trip_slab *s, unsigned sheets, trip_budget *budget);
void trip_slab_free(trip_slab *s);
/* Runs of a sheet come by ascending tile; call end_sheet after the last one of each sheet. `words`
 * is the length of the run's block. Returns the run's brick as it is now; NULL after a reported
 * failure. */
const trip_file_brick *trip_slab_add(trip_slab *s, unsigned sheet, uint32_t tile_u, uint32_t tile_v,
                                     const uint32_t *voxels, uint32_t count, uint32_t words);
void trip_slab_end_sheet(trip_slab *s);
void trip_slab_clear(trip_slab *s);

#endif
