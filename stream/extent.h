/* What one slot of the ring will hold: pieces of plane files, in whole pages, and the runs in
 * them. The planner packs a pass's runs, whole, into slots in draw order; it reads nothing. One
 * thread. */
#ifndef TRIP_EXTENT_H
#define TRIP_EXTENT_H

#include "selection.h"

#define TRIP_PIECES_MAX 16
#define TRIP_RANGES_MAX (TRIP_PIECES_MAX * TRIP_PLANES)

/* Runs of a list with small gaps between them: the bytes from the first to the last, by plane. */
typedef struct trip_piece {
    const trip_list *list;
    uint64_t low[TRIP_PLANES], high[TRIP_PLANES];
} trip_piece;

/* Bytes [offset, offset + bytes) of a plane file go to slot_offset of the slot's memory. Whole
 * pages, so that the last may reach beyond the file's end. */
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
    /* A plane's part of the slot. The runs' places count from there. */
    size_t plane_at[TRIP_PLANES], plane_bytes[TRIP_PLANES];
    trip_run *runs;
    size_t run_count, run_room;
    size_t bytes; /* of all ranges */
    uint64_t records;
} trip_extent;

typedef struct trip_planner {
    trip_pass_iterator it;
    trip_run run; /* the next one, where has_run */
    bool has_run;
    unsigned planes; /* bit per trip_plane to read */
    size_t normal_bytes;
    size_t page_bytes, slot_bytes, gap_bytes;
    bool (*skip)(void *user, const trip_selection *s, const trip_run *run);
    void *skip_user;
    bool one_piece; /* an extent has no more: it is of one list */
    uint64_t runs_skipped, bytes_skipped;
} trip_planner;

/* Bytes of the smallest slot that holds any run of the data set. */
size_t trip_planner_min_slot(const trip_dataset *d, unsigned planes);

/* slot_bytes is a multiple of page_bytes and not less than the least, gap_bytes at least
 * page_bytes. What was skipped adds up over passes. There is a cursor for each selection of the
 * pass. */
void trip_planner_begin(trip_planner *p, const trip_pass *pass, trip_pass_cursor *cursors);
/* Fills the extent, whose runs and run_room are set; false when no run is left. */
bool trip_planner_fill(trip_planner *p, trip_extent *e);

#endif
