/* Builds the lists from pieces that arrive in any order, in bounded memory, by an external merge
 * sort. Producers, one thread each, write pieces into memory that they reserve. The builder's own
 * thread appends the ordered list to the data set as it arrives. When memory fills up, it sorts the
 * pieces of the other lists and spills them to disk. At the end, the pieces on disk and in memory
 * are merged and written, all lists at the same time. The result depends only on the splats.
 *
 * Only the owner's thread may call the functions, except trip_list_builder_reserve(), which
 * producers call. */
#ifndef TRIP_LIST_BUILDER_H
#define TRIP_LIST_BUILDER_H

#include "journal.h"
#include "list_output.h"
#include "spill.h"
#include "workers.h"

/* The ordered list is the Z list of kept voxels: its sheets arrive in list order if a volume is
 * read slice by slice. */
enum { TRIP_ORDERED_LIST = 2 };

typedef struct trip_list_builder_params {
    trip_piece_format format;
    trip_quantiser quantiser; /* for the ordered list if it arrives in order */
    int64_t dims[3];
    unsigned producers;
    /* The ordered list arrives in order, batch by batch. It is written at once and never spilled.
     * All its splats of a batch must fit in memory. */
    bool in_order;
    unsigned from; /* number of the first list to build; no piece belongs to a list before it */
    unsigned first_list;   /* number of list `from` in the writer */
    uint64_t memory_bytes; /* memory for pieces */
    trip_writer *writer;
    trip_spill *spill;
    trip_journal *journal;
} trip_list_builder_params;

typedef struct trip_list_builder trip_list_builder;

/* Returns the minimum value of params.memory_bytes. */
uint64_t trip_list_builder_min_bytes(const trip_piece_format *f, unsigned producers);

int trip_list_builder_create(trip_list_builder **out, const trip_list_builder_params *params,
                             trip_budget *budget);
void trip_list_builder_destroy(trip_list_builder *b);

/* Returns the output of the ordered list, to append an interrupted run's part before the first
 * batch. */
trip_list_output *trip_list_builder_ordered(trip_list_builder *b);

/* Sets *memory to room for a piece of a list, aligned to 8 bytes. The producer must complete the
 * piece before it reserves again or the batch ends. Waits for memory. After a reported failure of
 * the builder's own thread, returns its status. */
int trip_list_builder_reserve(trip_list_builder *b, unsigned producer, unsigned list, size_t bytes,
                              void **memory);

/* Ends a batch. All its pieces must be complete, and no producer may be active. `done` is the share
 * of the volume read so far. Returns 1 if trip_list_builder_spill() is due, 0 if not, or a negative
 * status. */
int trip_list_builder_end_batch(trip_list_builder *b, double done);
/* Spills all pieces in the background, then writes the checkpoint to the journal. Call it right
 * after a batch. The builder frees the checkpoint, also on failure. */
int trip_list_builder_spill(trip_list_builder *b, trip_checkpoint *checkpoint);

/* Merges and appends all remaining pieces. Call it after the last batch. `quantiser` applies to all
 * lists that were not written in order. `progress`, if not NULL, is called on this thread with the
 * number of splats appended so far. */
int trip_list_builder_finish(trip_list_builder *b, const trip_quantiser *quantiser,
                             trip_workers *workers, void (*progress)(void *user, uint64_t splats),
                             void *user);

#endif
