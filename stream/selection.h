/* Which bricks of lists a pass reads, and the runs they give in draw order. A selection is of one
 * list; a pass merges several by list coordinate. Both are made by the plan, then read-only;
 * iterators are owned by one thread. Memory is one bit per brick, whatever the number of runs. */
#ifndef TRIP_SELECTION_H
#define TRIP_SELECTION_H

#include <stdbool.h>

#include "dataset.h"

typedef struct trip_selection {
    const trip_dataset *data;
    const trip_list *list;
    bool descending;                 /* draw order is the exact reverse of the file's */
    int64_t sheet_first, sheet_last; /* inclusive; what of the list this pass covers */
    uint64_t *bricks;                /* bit per brick of the list */
} trip_selection;

/* One direction over one or several selections of a data set, all with this direction. Runs come by
 * list coordinate of their sheets, at equal coordinates by selection, within a selection in its own
 * order; descending, exactly the other way round. */
typedef struct trip_pass {
    const trip_selection *selections;
    unsigned selection_count;
    bool descending;
} trip_pass;

static inline trip_pass trip_pass_of(const trip_selection *s)
{
    return (trip_pass){ s, 1, s->descending };
}

/* A brick's records in one sheet: [first, first + count) of the list, of tile origin (u, v). In a
 * descending pass they are drawn last to first. */
typedef struct trip_run {
    uint64_t first;
    size_t at[TRIP_PLANES]; /* where its bytes start: in the plane files, or a batch's planes */
    uint32_t count;
    uint32_t brick;
    uint16_t selection; /* its number in the pass */
    uint16_t words;     /* of its block, 8 bytes each */
    int32_t sheet;
    int32_t u, v;
} trip_run;

typedef struct trip_run_iterator {
    const trip_selection *selection;
    int64_t slab;           /* position in list->slabs */
    int64_t sheet;          /* within the slab */
    int64_t brick;          /* within the slab */
    uint64_t record, block; /* where the current brick's run starts (descending: ends) in the list,
                               and its block in the voxel plane */
} trip_run_iterator;

/* Without bricks. */
int trip_selection_create(trip_selection *s, const trip_dataset *d, const trip_list *list,
                          bool descending, int64_t sheet_first, int64_t sheet_last,
                          trip_budget *budget);
/* All of the list. */
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
/* False at the end. Runs with count 0 are left out. */
bool trip_run_next(trip_run_iterator *it, trip_run *run);

/* A selection of a pass and its next run. */
typedef struct trip_pass_cursor {
    trip_run_iterator it;
    trip_run run;
    double coordinate; /* of the run's sheet */
    bool has_run;
} trip_pass_cursor;

typedef struct trip_pass_iterator {
    const trip_pass *pass;
    trip_pass_cursor *cursors; /* the caller's: one for each selection */
    trip_pass_cursor *at;      /* that gives runs until its sheet ends; NULL: to be found */
} trip_pass_iterator;

trip_pass_iterator trip_pass_begin(const trip_pass *pass, trip_pass_cursor *cursors);
/* False at the end. */
bool trip_pass_next(trip_pass_iterator *it, trip_run *run);

#endif
