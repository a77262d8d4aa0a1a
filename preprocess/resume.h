/* What a killed run left of the list that is written in order. Its plane files are taken out of the
 * partial data set, before a new writer removes them, and appended again up to a checkpoint. */
#ifndef TRIP_RESUME_H
#define TRIP_RESUME_H

#include "block.h"
#include "list_builder.h"

typedef struct trip_leftover {
    int fd[TRIP_PLANES];         /* -1 where there is none */
    uint64_t bytes[TRIP_PLANES]; /* UINT64_MAX where the format has no such plane */
} trip_leftover;

static inline trip_leftover trip_leftover_none(void)
{
    return (trip_leftover){ .fd = { -1, -1 } };
}

/* Moves those plane files of the partial data set into the spill's folder, unless as much of them
 * is there already, and opens them. The caller holds the spill's lock. Links and files of other
 * users are a reported failure. */
int trip_leftover_take(trip_leftover *out, const trip_spill *spill, const char *partial_path,
                       const trip_piece_format *format);
void trip_leftover_close(trip_leftover *l);

/* Appends the runs of the journal's checkpoint, which lie in the files in the form of a data set.
 * Records that lie outside their tile or are out of order are a reported failure, as are runs that
 * are not as many, or as long, as the checkpoint says. */
int trip_leftover_replay(const trip_leftover *l, trip_journal *j, trip_list_builder *builder,
                         const trip_block_form *form, trip_budget *budget);

#endif
