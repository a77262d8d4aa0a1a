/* What an interrupted run left of the ordered list. Its plane files are moved out of the partial
 * data set before a new writer removes that, and their runs are appended again up to a checkpoint.
 * One thread. */
#ifndef TRIP_RESUME_H
#define TRIP_RESUME_H

#include "block.h"
#include "list_builder.h"

typedef struct trip_leftover {
    int fd[TRIP_PLANES];         /* -1 where there is none */
    uint64_t bytes[TRIP_PLANES]; /* length; UINT64_MAX where the format has no such plane */
} trip_leftover;

static inline trip_leftover trip_leftover_none(void)
{
    return (trip_leftover){ .fd = { -1, -1 } };
}

/* Moves the ordered list's plane files from the partial data set into the spill's folder, unless
 * that holds longer ones already, and opens them. The caller holds the spill's lock. Links and
 * files of other users are a reported failure. */
int trip_leftover_take(trip_leftover *out, const trip_spill *spill, const char *partial_path,
                       const trip_piece_format *format);
void trip_leftover_close(trip_leftover *l);

/* Appends the runs up to the journal's checkpoint, which the files hold in the form of a data set.
 * Records outside their tile or out of order, and runs whose number or length differs from the
 * checkpoint's, are a reported failure. */
int trip_leftover_replay(const trip_leftover *l, trip_journal *j, trip_list_builder *builder,
                         const trip_block_form *form, trip_budget *budget);

#endif
