/* One traversal of a volume. The calling thread reads portions while the workers process the boxes
 * of earlier portions. Along i and j a box never crosses a multiple of its edge, so that few boxes
 * contribute voxels to one tile of a sheet. */
#ifndef TRIP_WALK_H
#define TRIP_WALK_H

#include "volume.h"
#include "workers.h"

/* The voxels [lo, lo + size) of a portion. Decoding tells which of the voxels exist. */
typedef struct trip_box {
    const trip_volume *volume;
    const trip_volume_portion *portion;
    int64_t lo[3];
    int64_t size[3];
} trip_box;

typedef struct trip_walk_params {
    int64_t slices;  /* slices per portion of a dense volume */
    bool read_ahead; /* read the next portions while boxes are processed */
    int64_t edge;    /* of a box along i and j: a power of two, at least the edge of a tile */
    int64_t height;  /* of a box along k: a power of two, at most `edge` */
    uint64_t skip;   /* length of the skipped start of the volume, in units of `done` below */
    uint64_t stride; /* after `skip`, process every stride-th batch; 0 selects all */
    /* Processes a box on any worker thread. A negative status ends the walk, which returns the
     * status. */
    int (*box)(void *user, unsigned thread, const trip_box *box);
    /* Called on the calling thread after each batch, the portions in memory together, while no box
     * is processed. `done` counts slices of dense volumes and batches of sparse ones. `voxels`
     * counts their voxels. Both count from the start of the volume and include skipped parts.
     * `done` does not depend on the memory or the threads. */
    int (*batch)(void *user, uint64_t done, uint64_t voxels);
    void *user;
    double *skip_seconds; /* if not NULL, grows by the time spent on skipping for the stride */
} trip_walk_params;

/* Walks through the volume, which must have been opened or rewound just before. Reports an
 * interruption as a failure. */
int trip_walk(trip_volume *volume, trip_workers *workers, const trip_walk_params *params);

#endif
