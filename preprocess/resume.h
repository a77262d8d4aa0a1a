/* What a killed run left of the list that is written in order. Its plane files are taken out of the
 * partial data set, before a new writer removes them, and appended again up to a checkpoint. */
#ifndef TRIP_RESUME_H
#define TRIP_RESUME_H

#include <stdio.h>

#include "block.h"
#include "journal.h"
#include "list_output.h"

typedef struct trip_leftover {
    FILE *files[TRIP_PLANES]; /* NULL where there is none */
    trip_block_form form;
    uint64_t splats; /* that all planes hold, once counted */
} trip_leftover;

/* Moves the Z list's planes of the partial data set into the spill's folder, unless as much of them
 * is there already, and opens them. The caller holds the spill's lock. Links and files of other
 * users are a reported failure. */
int trip_leftover_take(trip_leftover *out, const trip_spill *spill, const char *partial_path,
                       const trip_block_form *form);
/* Reads through the blocks and counts what they hold. */
void trip_leftover_count(trip_leftover *l);
void trip_leftover_close(trip_leftover *l);

/* Appends the runs of the journal's checkpoint. Records that lie outside their tile or are out of
 * order are a reported failure, as are runs that are not as many as the checkpoint says. */
int trip_leftover_replay(const trip_leftover *l, trip_journal *j, trip_list_output *output,
                         trip_budget *budget);

#endif
