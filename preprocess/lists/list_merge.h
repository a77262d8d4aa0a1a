/* The last step of building lists. Merges the sorted sequences on disk and the pieces in memory
 * into the lists of the data set. One worker merges each list. */
#ifndef TRIP_LIST_MERGE_H
#define TRIP_LIST_MERGE_H

#include "list_output.h"
#include "piece_pool.h"
#include "spill.h"
#include "workers.h"

typedef struct trip_list_merge {
    trip_piece_pool *pool; /* free chunks become the read buffers of the sequences */
    trip_chain *in_memory; /* one for each list */
    trip_spill *spill;
    trip_list_output *outputs;  /* one for each list */
    bool lists[TRIP_MAX_LISTS]; /* true for the lists to merge */
    const trip_quantiser *quantiser;
} trip_list_merge;

/* Merges the selected lists. `progress` may be NULL; it is called on this thread with the number of
 * splats appended so far. Returns TRIP_INTERRUPTED if the user interrupts. */
int trip_list_merge_run(const trip_list_merge *m, trip_workers *workers,
                        void (*progress)(void *user, uint64_t splats), void *user);

/* Sorts the pieces of a chain and writes them to the spill as one sequence. */
int trip_spill_chain(trip_spill *spill, unsigned list, const trip_piece_pool *pool,
                     const trip_chain *chain);

#endif
