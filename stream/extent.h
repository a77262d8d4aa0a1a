/* The content of one slot of the ring: pieces of plane files in whole pages, and the runs in them.
 * The planner packs whole runs of a pass into slots, in draw order. It reads nothing. One thread.
 */
#ifndef TRIP_EXTENT_H
#define TRIP_EXTENT_H

#include "selection.h"

#define TRIP_PIECES_MAX 16
#define TRIP_RANGES_MAX (TRIP_PIECES_MAX * TRIP_PLANES)

/* Runs of a list with small gaps between them: bytes from the first to the last run, by plane. */
typedef struct trip_piece {
    const trip_list *list;
    uint64_t low[TRIP_PLANES], high[TRIP_PLANES];
} trip_piece;

/* Bytes [offset, offset + bytes) of a plane file, read to slot_offset in the slot. Whole pages, so
 * the last page may reach beyond the end of the file. */
typedef struct trip_byte_range {
    uint64_t offset;
    size_t bytes, slot_offset;
    const trip_list *list;
    int plane;
} trip_byte_range;

typedef struct trip_extent {
    trip_piece pieces[TRIP_PIECES_MAX];
    unsigned piece_count;
    trip_byte_range ranges[TRIP_RANGES_MAX];
    unsigned range_count;
    /* A plane's part of the slot. Offsets in runs count from there. */
    size_t plane_at[TRIP_PLANES], plane_bytes[TRIP_PLANES];
    trip_run *runs;
    size_t run_count, run_room;
    size_t bytes; /* of all ranges */
    uint64_t records;
} trip_extent;

typedef struct trip_planner {
    trip_pass_iterator it;
    trip_run run; /* the next run, if has_run */
    bool has_run;
    unsigned planes; /* one bit per trip_plane to read */
    size_t normal_bytes;
    size_t page_bytes, slot_bytes, gap_bytes;
    bool (*skip)(void *user, const trip_selection *s, const trip_run *run);
    void *skip_user;
    bool one_piece; /* an extent has one piece, of one list */
    uint64_t runs_skipped, bytes_skipped;
} trip_planner;

/* Returns the bytes of the smallest slot that holds any run of the data set. */
size_t trip_planner_min_slot(const trip_dataset *d, unsigned planes);

/* Begins a pass. slot_bytes is a multiple of page_bytes and at least the minimum; gap_bytes is at
 * least page_bytes. Skipped runs add up over passes. There is one cursor per selection of the pass.
 */
void trip_planner_begin(trip_planner *p, const trip_pass *pass, trip_pass_cursor *cursors);
/* Fills an extent with its runs and run_room set. Returns false if no run is left. */
bool trip_planner_fill(trip_planner *p, trip_extent *e);

#endif
