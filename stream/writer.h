/* Writes a data set: runs appended in list order to each of its lists, then the index. All
 * files grow in `NAME.trip.partial/`, which becomes `NAME.trip/` only when trip_writer_finish() has
 * synced everything. Different lists may be appended to by different threads at once. The bytes
 * depend on what is appended only. */
#ifndef TRIP_WRITER_H
#define TRIP_WRITER_H

#include <stdbool.h>

#include "block.h"
#include "budget.h"
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
    double sheet_first, sheet_step; /* list coordinate of sheet 0, and between sheets */
} trip_writer_list;

/* What codes and normals stand for; the latter by normal_bytes. */
typedef struct trip_writer_codes {
    double code_lo, code_hi;
    double gradient_step[3], gradient_full;
} trip_writer_codes;

/* Zero means the default. */
typedef struct trip_writer_params {
    bool replace;          /* an existing NAME.trip is replaced; otherwise refused */
    bool halo;             /* the default lists have halos */
    unsigned code_bytes;   /* 1, for codes that 8 bits can stand for (format.h), or 2 (default) */
    unsigned normal_bytes; /* 3 or 4; 0: no normals */
    unsigned tile_voxels;  /* 16, 32, 64 (default) or 128 */
    unsigned slab_sheets;  /* default 8 */
    unsigned page_bytes;   /* default 16384 */
    int64_t dims[3];
    trip_affine index_to_world;
    const trip_coordinates
        *coordinates; /* kept until the end; NULL: spacing is even, as with levels */
    trip_writer_codes codes;
    /* Among them the voxels at level 0 along each axis, of the grid above. NULL: those, X, Y and Z,
     * and then their halos. */
    const trip_writer_list *lists;
    unsigned list_count;
} trip_writer_params;

int trip_writer_open(trip_writer **out, const char *path, const trip_writer_params *params,
                     trip_budget *budget);

/* One run: `count` records of tile (tile_u, tile_v) in `sheet` of a list, by its number, voxels in
 * Morton order of (u, v). Normals are in the form of normal_bytes, in the low bits; NULL where the
 * list has none. Runs must come in list order (sheet, then Morton code of the tile). */
int trip_writer_append(trip_writer *w, unsigned list, uint32_t sheet, uint32_t tile_u,
                       uint32_t tile_v, const uint32_t *voxels, const uint32_t *normals,
                       uint32_t count);

/* Replaces what the parameters said of codes and gradients: records hold codes, so that their range
 * may be found while the volume is read. Before finish. */
int trip_writer_set_codes(trip_writer *w, const trip_writer_codes *codes);

/* What is known only at the end. */
typedef struct trip_writer_summary {
    double value_min, value_max;
    uint64_t voxels;
    const char *text; /* JSON */
} trip_writer_summary;

/* Fails when lists of a kind and level hold different numbers of records. On any failure call
 * abort. */
int trip_writer_finish(trip_writer *w, const trip_writer_summary *summary);
/* A descriptor of the partial folder, which becomes the data set; owned by `w`. */
int trip_writer_folder(const trip_writer *w);
/* Removes the partial folder. Also frees `w`; finish frees it itself on success only. */
void trip_writer_abort(trip_writer *w);

/* The runs of a list that nothing is appended to any more, read back in list order: what coarser
 * levels are made from before the data set is finished. Memory does not grow with the list. One
 * thread goes on from run to run, any may read those that it came to. */
typedef struct trip_list_cursor trip_list_cursor;

/* Where a run is. */
typedef struct trip_list_position {
    uint32_t sheet;
    trip_file_brick brick;
    trip_file_run run;
    uint64_t at[TRIP_PLANES];
} trip_list_position;

/* What a thread reads a run into. */
typedef struct trip_list_buffer trip_list_buffer;

/* Sheets with sheet % 2 == `odd` alone; without `normals` these are not read. */
int trip_list_cursor_open(trip_list_cursor **out, trip_writer *w, unsigned list, bool odd,
                          bool normals, trip_budget *budget);
void trip_list_cursor_close(trip_list_cursor *c);
/* 1: *place is that of the next one; 0: there is none; negative: failed. */
int trip_list_cursor_next(trip_list_cursor *c, trip_list_position *position);

int trip_list_buffer_create(trip_list_buffer **out, const trip_writer *w, trip_budget *budget);
void trip_list_buffer_destroy(trip_list_buffer *b, trip_budget *budget);
uint64_t trip_list_buffer_bytes(void);
/* The run there, checked, in the buffer; its normals NULL where they are not read. `words`: of its
 * block and of those right behind it that will be read next into the same buffer, which are fetched
 * with it; 0: none will be. */
int trip_list_cursor_read(const trip_list_cursor *c, const trip_list_position *position,
                          uint64_t words, trip_list_buffer *to, trip_block *out);

uint64_t trip_writer_bytes(const trip_writer *w);
/* Of a list, by its number. */
uint64_t trip_writer_records(const trip_writer *w, unsigned list);
uint64_t trip_writer_plane_bytes(const trip_writer *w, unsigned list, int plane);

#endif
