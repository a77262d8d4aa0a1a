/* An opened `NAME.trip/`: its checked header and index, read-only and shared by threads after
 * trip_dataset_open(). Everything in it has been validated: checksums, sizes, orders, sums, ranges,
 * so that callers need not check again. Plane data is not read here; reader.h does that. */
#ifndef TRIP_DATASET_H
#define TRIP_DATASET_H

#include <stdbool.h>

#include "budget.h"
#include "coordinates.h"
#include "format.h"
#include "geometry.h"
#include "kind.h"

#define TRIP_INDEX_NAME "index.trip"

/* Records of one kind, in the order along one axis, at one level. */
typedef struct trip_list {
    unsigned index;   /* in the data set's lists */
    unsigned part;    /* where several data sets are joined: the number of its own; else 0 */
    const char *path; /* of its data set, for messages */
    int axis;
    unsigned level; /* 0: full resolution */
    trip_kind kind;
    unsigned planes; /* bit per trip_plane present */
    int64_t dims[3]; /* of the list's own grid, along i, j, k */
    trip_affine index_to_world;
    double sheet_first, sheet_step; /* places sheets along the list coordinate: level-0 indices */
    uint64_t records;
    uint64_t slab_count, brick_count;
    const trip_file_slab *slabs;
    const trip_file_brick *bricks;
    const trip_file_run *runs;                   /* [brick][sheet in slab] */
    const uint64_t *page_checksums[TRIP_PLANES]; /* NULL where the plane is absent */
    uint64_t plane_bytes[TRIP_PLANES];
    int plane_fd[TRIP_PLANES]; /* -1 where absent; opened for reading */
} trip_list;

typedef struct trip_dataset {
    char *path;
    trip_file_header header;
    trip_affine index_to_world; /* of level 0; with uneven spacing of the places there */
    trip_coordinates coordinates;
    trip_list *lists; /* from the budget */
    unsigned list_count;
    char *text;     /* JSON, terminated */
    uint64_t bytes; /* of all files */
    void *memory;   /* the index; from the budget */
    size_t memory_bytes;
    trip_budget *budget;
} trip_dataset;

int trip_dataset_open(trip_dataset **out, const char *path, trip_budget *budget);
void trip_dataset_close(trip_dataset *d);

/* Reads every page of every plane and checks it, and that records agree with the index (positions
 * inside the brick's bounds, codes inside its range, padding zero; the lists of a kind and level
 * hold the same records, and no two kinds of a level the same voxel). Reports the first fault. */
int trip_dataset_verify(const trip_dataset *d, trip_budget *budget);

/* The first and last voxel kept along each index axis; without any, those of the grid. Level 0's
 * alone, as is all that framing goes by (render/visible.h): that is right for levels each of which
 * shows all of one object. What another level alone shows takes no part in it. */
void trip_dataset_kept_bounds(const trip_dataset *d, double lo[3], double hi[3]);

/* NULL where the data set has no such list; of several that are joined the first one's. */
const trip_list *trip_dataset_find(const trip_dataset *d, int axis, unsigned level, trip_kind kind);

/* Lists of that kind, one of each data set that is joined: the one after `list`, or the first after
 * NULL; NULL: there are no more. */
const trip_list *trip_dataset_next(const trip_dataset *d, const trip_list *list, int axis,
                                   unsigned level, trip_kind kind);
/* The list along `axis` that has the records of `list`, which may be that itself; NULL: none has.
 */
const trip_list *trip_dataset_along(const trip_dataset *d, const trip_list *list, int axis);

/* How many data sets are joined; 1: it is one. */
static inline unsigned trip_dataset_parts(const trip_dataset *d)
{
    return d->list_count ? d->lists[d->list_count - 1].part + 1 : 1;
}

/* Where a sheet lies along the list's axis, in level-0 index units: passes merge lists by it. */
static inline double trip_list_sheet_coordinate(const trip_list *list, int64_t sheet)
{
    return list->sheet_first + list->sheet_step * (double)sheet;
}

/* Name of a plane file, "x0.voxels"; `name` has room for 32 bytes. */
const char *trip_plane_file_name(int axis, unsigned level, trip_kind kind, int plane, char *name);
const char *trip_list_plane_name(const trip_list *list, int plane, char *name);
/* Whether some list's plane file is so named. */
bool trip_plane_file_is_named(const char *name);

#endif
