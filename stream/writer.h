/* Writes a data set: runs are appended in list order to each list, then the index is written. All
 * files grow in `NAME.trip.partial/`. The folder becomes `NAME.trip/` only when
 * trip_writer_finish() has synced everything. Different threads may append to different lists at
 * once. The bytes depend only on the records appended. */
#ifndef TRIP_WRITER_H
#define TRIP_WRITER_H

#include <stdbool.h>

#include "block.h"
#include "budget.h"
#include "codes.h"
#include "coordinates.h"
#include "format.h"
#include "geometry.h"
#include "kind.h"

typedef struct trip_writer trip_writer;

typedef struct trip_writer_list {
    int axis;
    unsigned level;
    trip_kind kind;
    int64_t dims[3];
    trip_affine index_to_world;
    double sheet_first, sheet_step; /* list coordinate of sheet 0; step between sheets */
} trip_writer_list;

/* The scale of codes and of normals. The form of normals depends on normal_bytes. */
typedef struct trip_writer_codes {
    double code_lo, code_hi;
    /* Values of codes, as in trip_codes, which must exist until the end. NULL means even codes.
     * With a table, code_lo and code_hi follow from it. */
    const double *table;
    uint32_t table_entries;
    unsigned table_step_log2;
    double gradient_step[3], gradient_full;
} trip_writer_codes;

/* Zero selects the default. */
typedef struct trip_writer_params {
    bool replace; /* replaces an existing NAME.trip, which is refused otherwise */
    bool halo;    /* the default lists include halo lists */
    /* 1, for codes that 8 bits can represent (format.h), or 2 (default). */
    unsigned code_bytes;
    unsigned normal_bytes; /* 3 or 4; 0 means no normals */
    unsigned tile_voxels;  /* 16, 32, 64 (default) or 128 */
    unsigned slab_sheets;  /* default 8 */
    unsigned page_bytes;   /* default 16384 */
    int64_t dims[3];
    trip_affine index_to_world;
    /* Must exist until the end. NULL means even spacing, which coarse levels require. */
    const trip_coordinates *coordinates;
    trip_writer_codes codes;
    /* Must include the voxels of level 0 along each axis, on the grid above. NULL selects these
     * three lists, X, Y and Z, and then their halo lists. */
    const trip_writer_list *lists;
    unsigned list_count;
} trip_writer_params;

int trip_writer_open(trip_writer **out, const char *path, const trip_writer_params *params,
                     trip_budget *budget);

/* Gives all lists of values planes of deviations. Lists of values must be empty. */
int trip_writer_add_deviations(trip_writer *w);

/* Appends one run: `count` records of tile (tile_u, tile_v) in `sheet` of list `list`. Voxels are
 * in Morton order of (u, v). `beside` has the records of the list's other plane in the low bits:
 * normals in the form of normal_bytes, or deviations. It is NULL if the list has neither. Runs must
 * come in list order (sheet, then Morton code of the tile). */
int trip_writer_append(trip_writer *w, unsigned list, uint32_t sheet, uint32_t tile_u,
                       uint32_t tile_v, const uint32_t *voxels, const uint32_t *beside,
                       uint32_t count);

/* Replaces the scale of codes and gradients from the parameters. Records hold codes, so the range
 * may be found while the volume is read. Call before finish. */
int trip_writer_set_codes(trip_writer *w, const trip_writer_codes *codes);

/* Values known only at the end. */
typedef struct trip_writer_summary {
    double value_min, value_max;
    double typical_min, typical_max; /* if both are 0: the whole range */
    uint64_t voxels;
    const char *text; /* JSON */
} trip_writer_summary;

/* Writes the index and completes the data set. Fails if lists of a kind and level have different
 * numbers of records. After any failure call trip_writer_abort(). */
int trip_writer_finish(trip_writer *w, const trip_writer_summary *summary);
/* Returns a descriptor of the partial folder, which becomes the data set. Owned by `w`. */
int trip_writer_folder(const trip_writer *w);
/* Removes the partial folder and frees `w`. trip_writer_finish() frees `w` only on success. */
void trip_writer_abort(trip_writer *w);

/* Reads back the runs of a completely appended list, in list order. Coarse levels are made from
 * them before the data set is finished. Memory does not grow with the list. One thread advances the
 * cursor; any thread may read the runs that it reached. */
typedef struct trip_list_cursor trip_list_cursor;

/* The position of a run. */
typedef struct trip_list_position {
    uint32_t sheet;
    trip_file_brick brick;
    trip_file_run run;
    uint64_t at[TRIP_PLANES];
} trip_list_position;

/* A buffer into which one thread reads a run. */
typedef struct trip_list_buffer trip_list_buffer;

/* Opens a cursor on the sheets with sheet % 2 == `odd`. Without `normals`, normals are not read. */
int trip_list_cursor_open(trip_list_cursor **out, trip_writer *w, unsigned list, bool odd,
                          bool normals, trip_budget *budget);
void trip_list_cursor_close(trip_list_cursor *c);
/* Returns 1 with the next run in *position, 0 at the end, or a negative status. */
int trip_list_cursor_next(trip_list_cursor *c, trip_list_position *position);

int trip_list_buffer_create(trip_list_buffer **out, const trip_writer *w, trip_budget *budget);
void trip_list_buffer_destroy(trip_list_buffer *b, trip_budget *budget);
uint64_t trip_list_buffer_bytes(void);
/* Reads and checks the run at *position into the buffer. Its normals are NULL if they are not read.
 * `words` is the length of its block and of the blocks right after it that the same buffer will
 * read next. They are fetched together; 0 fetches only this block. */
int trip_list_cursor_read(const trip_list_cursor *c, const trip_list_position *position,
                          uint64_t words, trip_list_buffer *to, trip_block *out);

uint64_t trip_writer_bytes(const trip_writer *w);
/* By list index. */
uint64_t trip_writer_records(const trip_writer *w, unsigned list);
uint64_t trip_writer_plane_bytes(const trip_writer *w, unsigned list, int plane);

#endif
