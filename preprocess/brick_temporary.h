/* The temporary files of a run of `brick`, beside its output: spilled pieces, the journal, and what
 * an interrupted run left of the ordered list. One thread. */
#ifndef TRIP_BRICK_TEMPORARY_H
#define TRIP_BRICK_TEMPORARY_H

#include "brick_input.h"
#include "resume.h"

typedef struct trip_brick_temporary {
    trip_spill *spill;
    trip_journal *journal;
    trip_leftover leftover;
    uint64_t identity;  /* of the run */
    char *partial_path; /* of the data set while it is written */
    bool begun;         /* set by the run: what an interrupted run left was used or discarded */
} trip_brick_temporary;

static inline trip_brick_temporary trip_brick_temporary_none(void)
{
    return (trip_brick_temporary){ .leftover = trip_leftover_none() };
}

/* Locks the folder of temporary files and, with `resume`, reads what an interrupted run left. The
 * input's functions are loaded. */
int trip_brick_temporary_open(trip_brick_temporary *t, const trip_brick_input *in,
                              const trip_piece_format *format);

/* Whether the interrupted run spilled pieces of the ordered list. */
bool trip_brick_temporary_has_ordered(const trip_brick_temporary *t);
/* Whether the interrupted run had completed its output, which is still there, and only temporary
 * files are left. Another data set of that name is none of this run's. */
bool trip_brick_temporary_is_done(const trip_brick_temporary *t, const trip_brick_params *params);

/* Begins the journal of a new run; that of a resumed one has begun. */
int trip_brick_temporary_begin(trip_brick_temporary *t, const trip_brick_input *in);

/* To be called when `folder`, of which this is a descriptor, is about to become the output. */
int trip_brick_temporary_note_output(trip_brick_temporary *t, const trip_brick_input *in,
                                     int folder);

/* Decides, from the run's status, what remains after closing. Files remain for a run with `resume`
 * that was interrupted, and the partial data set's ordered list is moved to them; other runs that
 * have begun or succeeded leave none. A run that failed before it began leaves what it found. */
void trip_brick_temporary_end(trip_brick_temporary *t, const trip_piece_format *format, bool resume,
                              int status);
/* May also be called after a failure to open. */
void trip_brick_temporary_close(trip_brick_temporary *t);

#endif
