/* The temporary files of a run of `brick`, next to its output: spilled pieces, the journal, and an
 * interrupted run's part of the ordered list. One thread. */
#ifndef TRIP_BRICK_TEMPORARY_H
#define TRIP_BRICK_TEMPORARY_H

#include "brick_input.h"
#include "resume.h"

typedef struct trip_brick_temporary {
    trip_spill *spill;
    trip_journal *journal;
    trip_leftover leftover;
    uint64_t identity;  /* identity of the run (identity.h) */
    char *partial_path; /* path of the data set while it is written */
    bool begun;         /* set by the run: an interrupted run's files were used or discarded */
} trip_brick_temporary;

static inline trip_brick_temporary trip_brick_temporary_none(void)
{
    return (trip_brick_temporary){ .leftover = trip_leftover_none() };
}

/* Locks the folder of temporary files. With `resume`, reads the files of an interrupted run. The
 * input's transfer functions must be loaded. */
int trip_brick_temporary_open(trip_brick_temporary *t, const trip_brick_input *in,
                              const trip_piece_format *format);

/* Returns whether the interrupted run spilled pieces of the ordered list. */
bool trip_brick_temporary_has_ordered(const trip_brick_temporary *t);
/* Returns whether the interrupted run completed its output, which still exists, and left only
 * temporary files. Another data set of the same name does not count. */
bool trip_brick_temporary_is_done(const trip_brick_temporary *t, const trip_brick_params *params);

/* Begins the journal of a new run. A resumed run has one already. */
int trip_brick_temporary_begin(trip_brick_temporary *t, const trip_brick_input *in);

/* Records that `folder`, an open descriptor, is about to become the output. */
int trip_brick_temporary_note_output(trip_brick_temporary *t, const trip_brick_input *in,
                                     int folder);

/* Decides from the run's status which files remain after closing:
 * - An interrupted run with `resume` keeps its files, and moves the ordered list to them.
 * - A run that failed before it began leaves the files that it found.
 * - Every other run leaves none. */
void trip_brick_temporary_end(trip_brick_temporary *t, const trip_piece_format *format, bool resume,
                              int status);
/* Closes the files, also after a failure to open. */
void trip_brick_temporary_close(trip_brick_temporary *t);

#endif
