/* The bricks of lists that a pass reads, and their runs in draw order. A selection belongs to one
 * list; a pass merges several selections by list coordinate. The plan creates both, and they are
 * read-only afterwards. One thread owns an iterator. A selection takes one bit per brick, for any
 * number of runs. */
#ifndef TRIP_SELECTION_H
#define TRIP_SELECTION_H

#include <stdbool.h>

#include "dataset.h"

typedef struct trip_selection {
    const trip_dataset *data;
    const trip_list *list;
    bool descending;                 /* draw order is the exact reverse of file order */
    int64_t sheet_first, sheet_last; /* inclusive range of sheets that the pass covers */
    int ahead;                       /* sheets that the pass is ahead of their list coordinates */
    uint64_t *bricks;                /* one bit per brick of the list */
} trip_selection;

/* One or more selections of a data set, all in the same direction. Runs are ordered by the list
 * coordinate of their sheets, at equal coordinates by selection, and within a selection in its own
 * order. A descending pass has exactly the reverse order. */
typedef struct trip_pass {
    const trip_selection *selections;
    unsigned selection_count;
    bool descending;
    /* If normals are computed: the runs to read for them. It includes all runs of this pass and the
     * runs beside them, one sheet ahead. NULL in all other passes. */
    const struct trip_pass *around;
} trip_pass;

static inline trip_pass trip_pass_of(const trip_selection *s)
{
    return (trip_pass){ .selections = s, .selection_count = 1, .descending = s->descending };
}

/* The records of a brick in one sheet: [first, first + count) of the list, with tile origin (u, v).
 * A descending pass draws them from the last to the first. */
typedef struct trip_run {
    uint64_t first;
    /* Offset of its bytes in the plane files, or in a batch's planes. */
    size_t at[TRIP_PLANES];
    uint32_t count;
    uint32_t brick;
    uint16_t selection; /* index in the pass */
    uint16_t words;     /* of its block, 8 bytes each */
    int32_t sheet;
    int32_t u, v;
} trip_run;

typedef struct trip_run_iterator {
    const trip_selection *selection;
    int64_t slab;  /* index in list->slabs */
    int64_t sheet; /* within the slab */
    int64_t brick; /* within the slab */
    /* Start (descending: end) of the current brick's run in the list, and of its block in the voxel
     * plane. */
    uint64_t record, block;
} trip_run_iterator;

/* Creates a selection without bricks. */
int trip_selection_create(trip_selection *s, const trip_dataset *d, const trip_list *list,
                          bool descending, int64_t sheet_first, int64_t sheet_last,
                          trip_budget *budget);
/* Creates a selection of the whole list. */
int trip_selection_create_whole(trip_selection *s, const trip_dataset *d, const trip_list *list,
                                bool descending, trip_budget *budget);
void trip_selection_destroy(trip_selection *s, trip_budget *budget);

static inline void trip_selection_add(trip_selection *s, uint64_t brick)
{
    s->bricks[brick / 64] |= UINT64_C(1) << (brick % 64);
}

static inline void trip_selection_remove(trip_selection *s, uint64_t brick)
{
    s->bricks[brick / 64] &= ~(UINT64_C(1) << (brick % 64));
}

static inline bool trip_selection_has(const trip_selection *s, uint64_t brick)
{
    return s->bricks[brick / 64] >> (brick % 64) & 1;
}

trip_run_iterator trip_run_begin(const trip_selection *s);
/* Returns false at the end. Leaves out runs with count 0. */
bool trip_run_next(trip_run_iterator *it, trip_run *run);

/* A selection of a pass, with its next run. */
typedef struct trip_pass_cursor {
    trip_run_iterator it;
    trip_run run;
    double coordinate; /* of the run's sheet */
    bool has_run;
} trip_pass_cursor;

typedef struct trip_pass_iterator {
    const trip_pass *pass;
    trip_pass_cursor *cursors; /* the caller's, one per selection */
    trip_pass_cursor *at;      /* current cursor until its sheet ends; NULL before it is found */
} trip_pass_iterator;

trip_pass_iterator trip_pass_begin(const trip_pass *pass, trip_pass_cursor *cursors);
/* Returns false at the end. */
bool trip_pass_next(trip_pass_iterator *it, trip_run *run);

#endif
