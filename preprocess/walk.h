/* One traversal of a volume: the calling thread reads portions while the workers process the boxes
 * that earlier portions were cut into. Along i and j a box never crosses a multiple of its edge, so
 * that few boxes give voxels to one tile of a sheet. */
#ifndef TRIP_WALK_H
#define TRIP_WALK_H

#include "volume.h"
#include "workers.h"

/* The voxels [lo, lo + size) of a portion; which of them exist is known once it is decoded. */
typedef struct trip_box {
    const trip_volume *volume;
    const trip_volume_portion *portion;
    int64_t lo[3];
    int64_t size[3];
} trip_box;

typedef struct trip_walk_params {
    int64_t slices;  /* of a portion of a dense volume */
    bool read_ahead; /* read the next portions while the boxes of some are processed */
    int64_t edge;    /* of a box along i and j: a power of two, at least that of a tile */
    int64_t height;  /* of a box along k: a power of two, at most `edge` */
    uint64_t skip;   /* how much of the volume is skipped at its start, counted as `done` below */
    uint64_t stride; /* after that, of `stride` batches the first is processed; 0: each is */
    /* Processes a box, on any of the workers' threads. Negative ends the walk with that status. */
    int (*box)(void *user, unsigned thread, const trip_box *box);
    /* A batch, the portions that are in memory together, is finished: called on the calling thread
     * while no box is processed. `done` counts slices of dense volumes and batches of sparse ones,
     * `voxels` their voxels, both from the start of the volume with what was skipped. `done` does
     * not depend on the memory or the threads. */
    int (*batch)(void *user, uint64_t done, uint64_t voxels);
    void *user;
    double *skip_seconds; /* grows by the time that the stride's skipping took; or NULL */
} trip_walk_params;

/* Walks through the volume, which must have been opened or rewound just before. An interruption is
 * a reported failure. */
int trip_walk(trip_volume *volume, trip_workers *workers, const trip_walk_params *params);

#endif
