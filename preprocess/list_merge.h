/* The last step of building lists: merges the sorted sequences on disk and the pieces in memory
 * into the lists of the data set. Each list is merged by one worker. */
#ifndef TRIP_LIST_MERGE_H
#define TRIP_LIST_MERGE_H

#include "list_output.h"
#include "piece_pool.h"
#include "spill.h"
#include "workers.h"

typedef struct trip_list_merge {
    trip_piece_pool *pool; /* its free chunks become the sequences' read buffers */
    trip_chain *in_memory; /* of each list */
    trip_spill *spill;
    trip_list_output *outputs;  /* of each list */
    bool lists[TRIP_MAX_LISTS]; /* to merge */
    const trip_quantiser *quantiser;
} trip_list_merge;

/* `progress` as for trip_list_builder_finish(). */
int trip_list_merge_run(const trip_list_merge *m, trip_workers *workers,
                        void (*progress)(void *user, uint64_t splats), void *user);

/* Sorts the pieces of a chain into a sequence of the spill. */
int trip_spill_chain(trip_spill *spill, unsigned list, const trip_piece_pool *pool,
                     const trip_chain *chain);

#endif
