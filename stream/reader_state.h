/* What the reader's two files share: reader.c makes it, reader_pass.c runs passes. */
#ifndef TRIP_READER_STATE_H
#define TRIP_READER_STATE_H

#include <pthread.h>

#include "border.h"
#include "engine.h"
#include "extent.h"
#include "reader.h"

/* Room to keep cached pages apart from others within a range. */
#define TRIP_SLOT_REQUESTS_MAX (4 * TRIP_RANGES_MAX)

typedef enum trip_slot_state {
    TRIP_SLOT_FREE,
    TRIP_SLOT_READING,  /* ready when nothing is pending */
    TRIP_SLOT_GIVEN_UP, /* was being read when its frame was given up; free when nothing is pending
                         */
    TRIP_SLOT_DRAWING,
} trip_slot_state;

typedef struct trip_slot {
    trip_reader *reader;
    trip_slot_state state;
    unsigned pending; /* under the reader's lock: requests not done */
    unsigned char *memory;
    const trip_pass *pass;
    uint32_t cache_pass; /* number of the pass in the cache */
    trip_extent extent;
    trip_borders borders;            /* kept for the next slot when this one is handed out */
    trip_border_copies from_borders; /* before that, copied from those of the slot before */
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
    trip_cache *cache;                   /* or NULL */
    const trip_pass *passes[TRIP_READER_PASSES_MAX];
    unsigned pass_count, pass; /* pass: the one being planned; pass_count when all are planned */
    trip_planner planner;
    trip_pass_cursor *cursors; /* of the pass being planned: one for each list */
    uint32_t cache_pass;       /* of the pass being planned */
    trip_borders borders;      /* of the slot planned last */
    int failed;                /* status that ended the passes */
    bool runs_only;
    bool in_memory; /* batches lie in the cache: nothing is requested, and slots hold only runs */
    trip_reader_stats stats;
    uint64_t *list_bytes; /* stats.bytes_read by list */
    trip_slot *slots;
    unsigned char *slot_memory;   /* NULL where it is the caller's */
    unsigned char *border_memory; /* pages at the borders of the slot handed out last */
    trip_run *runs;
    /* Slots being read, in draw order, from queue[queue_first % slots] on. */
    trip_slot **queue;
    unsigned queue_first, queue_count;
    unsigned given_up_count; /* slots in that state */
    pthread_mutex_t lock;
    pthread_cond_t ready; /* a slot has nothing pending any more */
};

/* Starts the engine, or one that takes its place; 0 or -errno, which is not reported. */
int trip_reader_start_engine(trip_engine engine, unsigned depth, unsigned threads,
                             const trip_engine_ops **ops, void **state);
/* The same open file once more, with O_DIRECT; by its descriptor, so that it is the same file even
 * when another has taken its name. -1 where the file system, or a missing /proc, does not allow it:
 * then reads go through the page cache. */
int trip_reader_open_direct(int fd);
/* Gives up the passes and waits until nothing is being read. */
void trip_reader_drain(trip_reader *r);

#endif
