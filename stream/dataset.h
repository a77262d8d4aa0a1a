/* An opened `NAME.trip/`: its checked header and index, read-only and shared by threads after
 * trip_dataset_open(). Everything in it has been validated: checksums, sizes, orders, sums, ranges,
 * so that callers need not check again. Plane data is not read here; reader.h does that. */
#ifndef TRIP_DATASET_H
#define TRIP_DATASET_H

#include "budget.h"
#include "format.h"
#include "geometry.h"

#define TRIP_INDEX_NAME "index.trip"

typedef struct trip_list {
    int axis;
    uint64_t splats;
    uint64_t slab_count, brick_count;
    const trip_file_slab *slabs;
    const trip_file_brick *bricks;
    const uint16_t *counts;                      /* [brick][sheet in slab] */
    const uint64_t *page_checksums[TRIP_PLANES]; /* NULL where the plane is absent */
} trip_list;

typedef struct trip_dataset {
    char *path;
    trip_file_header header;
    trip_affine index_to_world;
    trip_list lists[3];           /* X, Y, Z at level 0 */
    char *text;                   /* JSON, terminated */
    uint64_t bytes;               /* of all files */
    int plane_fd[3][TRIP_PLANES]; /* -1 where absent; opened for reading */
    void *memory;                 /* the index; from the budget */
    size_t memory_bytes;
    trip_budget *budget;
} trip_dataset;

int trip_dataset_open(trip_dataset **out, const char *path, trip_budget *budget);
void trip_dataset_close(trip_dataset *d);

/* Reads every page of every plane and checks it, and that records agree with the index (positions
 * inside the brick's bounds, in Morton order, codes inside its range, spare bits zero, the three
 * lists hold the same voxels). Reports the first fault. */
int trip_dataset_verify(const trip_dataset *d, trip_budget *budget);

/* The first and last voxel kept along each index axis; without any, those of the grid. */
void trip_dataset_kept_bounds(const trip_dataset *d, double lo[3], double hi[3]);

/* Name of a plane file, "x.voxels"; `name` has room for 32 bytes. */
const char *trip_dataset_plane_name(int axis, int plane, char *name);

static inline double trip_dataset_value(const trip_dataset *d, unsigned code)
{
    return d->header.code_lo + (d->header.code_hi - d->header.code_lo) * code / 65535.0;
}

#endif
