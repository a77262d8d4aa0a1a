/* Builds the lists from pieces that arrive in any order, in bounded memory: an external merge sort.
 * Producers, one thread each, write pieces into memory that they reserve. The builder's own thread
 * appends the ordered list to the data set as it arrives, and sorts and spills the pieces of the
 * other lists to disk when memory fills up. At the end, pieces on disk and in memory are merged,
 * all lists at the same time, and written. The result depends on the splats only.
 *
 * All calls but trip_list_builder_reserve() are made by one thread, the owner. */
#ifndef TRIP_LIST_BUILDER_H
#define TRIP_LIST_BUILDER_H

#include "journal.h"
#include "list_output.h"
#include "spill.h"
#include "workers.h"

/* The ordered list: that of kept voxels along Z, whose sheets arrive in list order when a volume is
 * read slice by slice. */
enum { TRIP_ORDERED_LIST = 2 };

typedef struct trip_list_builder_params {
    trip_piece_format format;
    trip_quantiser quantiser; /* for the ordered list; that of the others is given at the end */
    int64_t dims[3];
    unsigned producers;
    /* The ordered list arrives in order, batch by batch: it is written as it comes and never
     * spilled. All its splats of a batch have to fit into memory. */
    bool in_order;
    unsigned from;         /* lists before that are not built: pieces have others alone */
    unsigned first_list;   /* of the writer: what list `from` is there */
    uint64_t memory_bytes; /* for pieces */
    trip_writer *writer;
    trip_spill *spill;
    trip_journal *journal;
} trip_list_builder_params;

typedef struct trip_list_builder trip_list_builder;

/* The least that params.memory_bytes may be. */
uint64_t trip_list_builder_min_bytes(const trip_piece_format *f, unsigned producers);

int trip_list_builder_create(trip_list_builder **out, const trip_list_builder_params *params,
                             trip_budget *budget);
void trip_list_builder_destroy(trip_list_builder *b);

/* The output of the ordered list, to append what an interrupted run had appended, before the first
 * batch. */
trip_list_output *trip_list_builder_ordered(trip_list_builder *b);

/* *memory becomes room for a piece of a list, aligned to 8 bytes; the piece has to be complete
 * before the same producer reserves again or the batch ends. Waits until there is memory. After a
 * failure of the builder's own thread, which was reported, returns its status. */
int trip_list_builder_reserve(trip_list_builder *b, unsigned producer, unsigned list, size_t bytes,
                              void **memory);

/* Ends a batch: all its pieces are complete, and no producer is active. `done` is the fraction of
 * the volume read so far. Returns 1 when trip_list_builder_spill() is due, 0 or a negative status.
 */
int trip_list_builder_end_batch(trip_list_builder *b, double done);
/* Right after a batch: spills all pieces in the background and then writes the checkpoint to the
 * journal. The builder frees the checkpoint, also on failure. */
int trip_list_builder_spill(trip_list_builder *b, trip_checkpoint *checkpoint);

/* After the last batch: merges and appends all that is not appended yet. `progress`, when not NULL,
 * is called on this thread with the number of splats appended so far. */
int trip_list_builder_finish(trip_list_builder *b, const trip_quantiser *quantiser,
                             trip_workers *workers, void (*progress)(void *user, uint64_t splats),
                             void *user);

#endif
