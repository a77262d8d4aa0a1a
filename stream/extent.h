/* What one slot of the ring will hold: pieces of plane files, in whole pages, and the runs in
 * them. The planner packs a pass's runs into slots in draw order; it reads nothing. One
 * thread. */
#ifndef TRIP_EXTENT_H
#define TRIP_EXTENT_H

#include "selection.h"

#define TRIP_SEGMENTS_MAX 16

/* Bytes [offset, offset + bytes) of a list's plane files go to slot_offset of the slot's memory.
 * Whole pages, so that the last may reach beyond the file's end. */
typedef struct trip_segment {
    uint64_t offset;
    size_t bytes, slot_offset;
    const trip_list *list;
} trip_segment;

typedef struct trip_extent {
    trip_segment segments[TRIP_SEGMENTS_MAX];
    unsigned segment_count;
    trip_run *runs; /* `first` counts from the slot's start */
    size_t run_count, run_room;
    size_t bytes; /* of all segments */
    uint64_t splats;
} trip_extent;

typedef struct trip_planner {
    trip_pass_iterator it;
    trip_run run; /* the next one, where has_run */
    bool has_run;
    size_t page_bytes, slot_bytes, gap_bytes;
    bool (*skip)(void *user, const trip_selection *s, uint32_t brick);
    void *skip_user;
    bool one_segment; /* an extent is of one list */
    uint64_t runs_skipped, splats_skipped;
    /* The segment being made: the bytes of its runs so far, and the page border it starts from (in
     * a descending pass: its end). */
    bool open;
    const trip_list *list;
    uint64_t low, high, anchor;
    size_t first_run;
} trip_planner;

/* slot_bytes is a multiple of page_bytes, gap_bytes at least page_bytes. What was skipped adds up
 * over passes. There is a cursor for each selection of the pass. */
void trip_planner_begin(trip_planner *p, const trip_pass *pass, trip_pass_cursor *cursors);
/* Fills the extent, whose runs and run_room are set; false when no run is left. */
bool trip_planner_fill(trip_planner *p, trip_extent *e);

#endif
