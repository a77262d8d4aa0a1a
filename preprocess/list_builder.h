/* The lists from pieces in any order, in bounded memory. Producers (one thread each) put
 * pieces into memory that they reserve; a background thread of the builder's own appends the list
 * that arrives in order to the data set, and sorts the others' pieces and spills them to disk when
 * memory fills up. At the end pieces on disk and in memory are merged, all lists at once, and
 * written. What is written depends on the splats only.
 *
 * Calls other than reserve are the owner's, from one thread. */
#ifndef TRIP_LIST_BUILDER_H
#define TRIP_LIST_BUILDER_H

#include "journal.h"
#include "list_output.h"
#include "spill.h"
#include "workers.h"

/* The list, of kept voxels along Z, whose sheets arrive in order where a volume is read slice by
 * slice. */
enum { TRIP_ORDERED_LIST = 2 };

typedef struct trip_list_builder_params {
    trip_piece_format format;
    trip_quantiser quantiser; /* of a list in order; the others get theirs at the end */
    int64_t dims[3];
    unsigned producers;
    /* That list's sheets arrive in order, batch by batch: it is written as it comes and never
     * spilled. All its splats of a batch have to fit. */
    bool in_order;
    uint64_t memory_bytes; /* for pieces */
    trip_writer *writer;
    trip_spill *spill;
    trip_journal *journal;
} trip_list_builder_params;

typedef struct trip_list_builder trip_list_builder;

/* Memory that params.memory_bytes must not be below. */
uint64_t trip_list_builder_min_bytes(const trip_piece_format *f, unsigned producers);

int trip_list_builder_create(trip_list_builder **out, const trip_list_builder_params *params,
                             trip_budget *budget);
void trip_list_builder_destroy(trip_list_builder *b);

/* The list in order, which an interrupted run had begun to append itself: its output, to be used
 * before the first batch. */
trip_list_output *trip_list_builder_ordered(trip_list_builder *b);

/* Memory for a piece of a list, aligned to 8 bytes; the piece has to be complete
 * before the same producer reserves again or the batch ends. Waits for memory. NULL when something
 * failed, which was reported. */
void *trip_list_builder_reserve(trip_list_builder *b, unsigned producer, unsigned list,
                                size_t bytes);

/* All pieces of a batch are there, and no producer is at work; `done` of all, 0 to 1, went by.
 * Returns 1 when it is time for trip_list_builder_spill(). */
int trip_list_builder_end_batch(trip_list_builder *b, double done);
/* Right after a batch: spills all there is in the background; then the journal gets the checkpoint,
 * which is the builder's to free() from now on. */
int trip_list_builder_spill(trip_list_builder *b, trip_checkpoint *checkpoint);

/* After the last batch: merges and appends what was not yet. `progress`, when not NULL, hears of
 * the splats appended so far, on the calling thread. */
int trip_list_builder_finish(trip_list_builder *b, const trip_quantiser *quantiser,
                             trip_workers *workers, void (*progress)(void *user, uint64_t splats),
                             void *user);

#endif
