/* The reader's state, shared by its files: reader.c creates it, reader_pass.c runs passes. */
#ifndef TRIP_READER_STATE_H
#define TRIP_READER_STATE_H

#include <pthread.h>

#include "border.h"
#include "computed_normals.h"
#include "engine.h"
#include "extent.h"
#include "reader.h"

/* Leaves room to separate cached pages from other pages within a range. */
#define TRIP_SLOT_REQUESTS_MAX (4 * TRIP_RANGES_MAX)

typedef enum trip_slot_state {
    TRIP_SLOT_FREE,
    TRIP_SLOT_READING, /* ready when nothing is pending */
    /* Its frame was given up while it was being read. Free when nothing is pending. */
    TRIP_SLOT_GIVEN_UP,
    TRIP_SLOT_DRAWING,
} trip_slot_state;

typedef struct trip_slot {
    trip_reader *reader;
    trip_slot_state state;
    unsigned pending; /* guarded by the reader's lock: requests not done */
    unsigned char *memory;
    const trip_pass *pass;
    uint32_t cache_pass; /* number of the pass in the cache */
    trip_extent extent;
    /* Kept for the next slot when this slot is handed out. */
    trip_borders borders;
    /* Copied from the borders of the slot before, when this slot is handed out. */
    trip_border_copies from_borders;
    trip_request requests[TRIP_SLOT_REQUESTS_MAX];
    unsigned request_count;
} trip_slot;

struct trip_reader {
    const trip_dataset *data;
    trip_reader_params params;
    trip_budget *budget;
    const trip_engine_ops *ops;
    void *engine;
    bool read_planes[TRIP_PLANES];
    _Atomic bool direct_refused;
    trip_source (*sources)[TRIP_PLANES]; /* by list */
    trip_cache *cache;                   /* may be NULL */
    const trip_pass *passes[TRIP_READER_PASSES_MAX];
    /* Index of the pass being planned; pass_count after the last. */
    unsigned pass_count, pass;
    trip_planner planner;
    trip_pass_cursor *cursors; /* for the pass being planned, one per list */
    uint32_t cache_pass;       /* of the pass being planned */
    trip_borders borders;      /* of the slot planned last */
    int failed;                /* status that ended the passes */
    bool runs_only;
    bool in_memory; /* batches lie in the cache; nothing is requested, and slots hold only runs */
    /* Computes the normals of the data set; NULL if they are stored, or not wanted. */
    trip_computed_normals *normals;
    bool computing;  /* the passes of this frame take their runs from `normals` */
    trip_batch read; /* the batch that `normals` uses; its slot is NULL if there is none */
    const trip_pass *drawn_passes[TRIP_READER_PASSES_MAX]; /* passes[i] is around drawn_passes[i] */
    trip_reader_stats stats;
    uint64_t *list_bytes; /* stats.bytes_read by list */
    trip_slot *slots;
    unsigned char *slot_memory;   /* NULL if it is the caller's */
    unsigned char *border_memory; /* pages at the borders of the slot handed out last */
    trip_run *runs;
    /* Slots being read, in draw order, starting at queue[queue_first % slots]. */
    trip_slot **queue;
    unsigned queue_first, queue_count;
    unsigned given_up_count; /* slots in state TRIP_SLOT_GIVEN_UP */
    pthread_mutex_t lock;
    pthread_cond_t ready; /* signalled when a slot has nothing pending any more */
};

/* Starts the engine, or a substitute. Returns 0 or -errno; reports nothing. */
int trip_reader_start_engine(trip_engine engine, unsigned depth, unsigned threads,
                             const trip_engine_ops **ops, void **state);
/* Opens the same file again with O_DIRECT. Uses the descriptor, so that it is the same file even if
 * another file has taken its name. Returns -1 if the file system, or a missing /proc, does not
 * allow this; reads then go through the page cache. */
int trip_reader_open_direct(int fd);
/* Gives up the passes and waits until nothing is being read. */
void trip_reader_drain(trip_reader *r);

#endif
