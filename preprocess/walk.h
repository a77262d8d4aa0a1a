/* One pass over a volume: blocks are read by the calling thread while the workers are at the boxes
 * of those before. A box never crosses the borders of an aligned grid, so that what is made of one
 * lies in one place of each list. */
#ifndef TRIP_WALK_H
#define TRIP_WALK_H

#include "volume.h"
#include "workers.h"

/* The voxels [lo, lo + size) of a block; they exist where the block says so. */
typedef struct trip_box {
    const trip_volume *volume;
    const trip_volume_block *block;
    int64_t lo[3];
    int64_t size[3];
} trip_box;

typedef struct trip_walk_params {
    int64_t slices;  /* slices of a block, of formats that come in slices */
    bool read_ahead; /* read the next blocks while boxes are at work */
    int64_t edge;    /* of a box along i and j and of the grid: a power of two */
    int64_t height;  /* of a box along k: a power of two, at most `edge` */
    uint64_t skip;   /* of the volume, passed over at the start without boxes: see `batch` */
    uint64_t stride; /* then only every so many batches are looked at; default: all */
    int (*box)(void *user, unsigned thread, const trip_box *box); /* on any thread */
    /* A batch of blocks is done: on the calling thread, while no box is at work. `done` (slices, or
     * batches of sparse formats: the same whatever a run's memory is) and `voxels` count from the
     * start of the volume, what was passed over included. */
    int (*batch)(void *user, uint64_t done, uint64_t voxels);
    void *user;
    double *passing_seconds; /* gets what passing over took; or NULL */
} trip_walk_params;

/* Goes through the volume from where it stands, which is its start. A signal to stop is a reported
 * failure. */
int trip_walk(trip_volume *volume, trip_workers *workers, const trip_walk_params *params);

#endif
