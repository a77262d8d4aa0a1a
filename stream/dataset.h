/* An opened `NAME.trip/`: its checked header and index. Read-only and shared by threads after
 * trip_dataset_open(). Opening validates checksums, sizes, orders, sums and ranges, so callers need
 * no further checks. reader.h reads the plane files. */
#ifndef TRIP_DATASET_H
#define TRIP_DATASET_H

#include <stdbool.h>

#include "budget.h"
#include "codes.h"
#include "coordinates.h"
#include "format.h"
#include "geometry.h"
#include "kind.h"

#define TRIP_INDEX_NAME "index.trip"

/* Records of one kind along one axis at one level. */
typedef struct trip_list {
    unsigned index;   /* index in the data set's lists */
    unsigned part;    /* of joined data sets, the index of the list's own; otherwise 0 */
    const char *path; /* of the list's data set, for messages */
    int axis;
    unsigned level; /* 0 is the finest */
    trip_kind kind;
    unsigned planes; /* one bit per trip_plane present */
    int64_t dims[3]; /* of the list's grid, along i, j, k */
    trip_affine index_to_world;
    /* List coordinate of sheet 0, and step between sheets, in indices of level 0. */
    double sheet_first, sheet_step;
    uint64_t records;
    uint64_t slab_count, brick_count;
    const trip_file_slab *slabs;
    const trip_file_brick *bricks;
    const trip_file_run *runs;                   /* [brick][sheet in slab] */
    const uint64_t *page_checksums[TRIP_PLANES]; /* NULL if the plane is absent */
    uint64_t plane_bytes[TRIP_PLANES];
    int plane_fd[TRIP_PLANES]; /* open for reading; -1 if absent */
} trip_list;

typedef struct trip_dataset {
    char *path;
    trip_file_header header;
    /* For level 0. With uneven spacing it maps positions to world space. */
    trip_affine index_to_world;
    trip_coordinates coordinates;
    trip_codes codes; /* of voxels, halo and values */
    /* The normals of the header and the lists are on no disk (dataset_normals.h). */
    bool computes_normals;
    trip_list *lists; /* from the budget */
    unsigned list_count;
    char *text;     /* JSON, null-terminated */
    uint64_t bytes; /* of all files */
    void *memory;   /* the index; from the budget */
    size_t memory_bytes;
    trip_budget *budget;
} trip_dataset;

int trip_dataset_open(trip_dataset **out, const char *path, trip_budget *budget);
void trip_dataset_close(trip_dataset *d);

/* Reads and checks every page of every plane, and reports the first fault. Also checks the records
 * against the index:
 * - positions are inside the brick's bounds, codes inside its range
 * - padding is zero
 * - the lists of a kind and level hold the same records
 * - no two kinds of a level hold the same voxel */
int trip_dataset_verify(const trip_dataset *d, trip_budget *budget);

/* Returns the first and last kept voxel along each index axis, or the grid's bounds if no voxel was
 * kept. Considers level 0 only, as all framing does (render/camera/visible.h). This is right for
 * levels that each show the same whole object. */
void trip_dataset_kept_bounds(const trip_dataset *d, double lo[3], double hi[3]);

/* Returns a list, or NULL if the data set has no such list. If data sets are joined, returns the
 * list of the first. */
const trip_list *trip_dataset_find(const trip_dataset *d, int axis, unsigned level, trip_kind kind);

/* Iterates over the lists of a kind, one per joined data set. Returns the one after `list`, or the
 * first for NULL. Returns NULL at the end. */
const trip_list *trip_dataset_next(const trip_dataset *d, const trip_list *list, int axis,
                                   unsigned level, trip_kind kind);
/* Returns the list along `axis` with the same records as `list`, possibly `list` itself. Returns
 * NULL if there is none. */
const trip_list *trip_dataset_along(const trip_dataset *d, const trip_list *list, int axis);

/* Returns the number of joined data sets, 1 for a single data set. */
static inline unsigned trip_dataset_parts(const trip_dataset *d)
{
    return d->list_count ? d->lists[d->list_count - 1].part + 1 : 1;
}

/* Returns the list coordinate of a sheet, in indices of level 0 along the list's axis. Passes merge
 * lists by it. */
static inline double trip_list_sheet_coordinate(const trip_list *list, int64_t sheet)
{
    return list->sheet_first + list->sheet_step * (double)sheet;
}

/* Writes the name of a plane file, such as "x0.voxels", to `name` (at least 32 bytes). */
const char *trip_plane_file_name(int axis, unsigned level, trip_kind kind, int plane, char *name);
const char *trip_list_plane_name(const trip_list *list, int plane, char *name);
/* Whether some list's plane file has this name, of a volume or of a Gaussian scene. */
bool trip_plane_file_is_named(const char *name);

#endif
