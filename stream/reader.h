/* Streams the selected runs of lists from disk into slots of a ring and hands them out in draw
 * order. Every page is checked against its checksum before it is handed out. One thread calls
 * begin, next and release; the engine's own threads meet it at the ring only. The picture must not
 * depend on anything set here. */
#ifndef TRIP_READER_H
#define TRIP_READER_H

#include "block.h"
#include "selection.h"
#include "task_runner.h"

#define TRIP_READER_PASSES_MAX 8

typedef enum trip_engine {
    TRIP_ENGINE_AUTO,  /* io_uring where the kernel allows it, else pread */
    TRIP_ENGINE_URING, /* refused where the kernel does not allow it */
    TRIP_ENGINE_PREAD, /* threads */
    TRIP_ENGINE_NULL,  /* everything is read into memory at creation, and batches lie there, or are
                          copied from there to slots of the caller's: the same picture without the
                          disk, to find what drawing alone can reach */
} trip_engine;

/* Zero means the default. */
typedef struct trip_reader_params {
    trip_engine engine;
    unsigned planes; /* bit per trip_plane; voxels always */
    unsigned slots;  /* ring length, 2 or more, default 8 */
    /* Of all planes together, as trip_reader_slot_bytes() makes it: slots hold whole runs. */
    size_t slot_bytes;
    size_t gap_bytes; /* gaps up to this are read through; default 32 KiB, at least a page */
    unsigned threads; /* that read (pread) and check; default 4 */
    bool buffered;    /* through the page cache, not O_DIRECT */
    /* Of verified pages kept in memory between frames, from the budget; 0 = none. */
    size_t cache_bytes;
    /* The caller's own memory for the slots: `slots` pointers aligned to 4096 bytes, each to
     * slot_bytes, which are a multiple of the page size and not too few for a run. It is read into
     * until trip_reader_destroy() returns. NULL: taken from the budget. */
    void *const *slot_memory;
    /* Called right before a run's bytes are requested; true: it cannot matter any more, as where
     * saturated pixels occlude it, and is left out. On the thread that calls begin and next. */
    bool (*skip)(void *user, const trip_selection *s, const trip_run *run);
    void *skip_user;
    /* By which blocks are checked, called by the thread that calls next. */
    trip_task_runner runner;
    /* For tests: given the bytes that a read has put at `data` from `offset` on and its result (a
     * count or -errno), returns the result to go on with; may wait, and change the bytes. Called on
     * any of the engine's threads. */
    long (*fault)(void *user, void *data, uint64_t offset, size_t bytes, long result);
    void *fault_user;
} trip_reader_params;

/* Runs ready to draw, in draw order: run i has its block at planes[TRIP_PLANE_VOXELS] +
 * runs[i].at[TRIP_PLANE_VOXELS], which is checked, and its normals likewise. */
typedef struct trip_batch {
    const trip_pass *pass;
    const unsigned char *planes[TRIP_PLANES]; /* NULL where not read, or runs alone are wanted */
    size_t plane_bytes[TRIP_PLANES];          /* gaps included */
    uint64_t splats;                          /* records of all runs */
    const trip_run *runs;
    size_t run_count;
    void *slot;
} trip_batch;

/* The list that a run of a batch is of. */
static inline const trip_list *trip_batch_list(const trip_batch *b, const trip_run *run)
{
    return b->pass->selections[run->selection].list;
}

/* A run of a batch whose planes are there. */
static inline trip_block trip_block_of(const trip_batch *b, const trip_run *run)
{
    const trip_selection *s = &b->pass->selections[run->selection];
    const trip_block_form form = trip_block_form_of(&s->data->header, s->list->kind);
    bool normals = b->planes[TRIP_PLANE_NORMALS] && s->list->planes >> TRIP_PLANE_NORMALS & 1;
    return trip_block_make(
        &form, run->count, run->words, b->planes[TRIP_PLANE_VOXELS] + run->at[TRIP_PLANE_VOXELS],
        normals ? b->planes[TRIP_PLANE_NORMALS] + run->at[TRIP_PLANE_NORMALS] : NULL);
}

typedef struct trip_reader_stats {
    uint64_t bytes_read, reads;           /* from the disk, of slots handed out */
    uint64_t bytes_cached;                /* instead from the cache */
    uint64_t splats;                      /* handed out */
    uint64_t runs_skipped, bytes_skipped; /* by the skip callback; gaps read through count too */
    uint64_t wait_ns;                     /* time spent waiting for the disk */
} trip_reader_stats;

/* Whether reads by the engine land in memory that is not the process's own, as a driver's mapping,
 * and can be read back from there: tried with the data set's first page, past the page cache where
 * files can be read so. The memory has room for a page and is aligned to 4096 bytes. Nothing is
 * reported. */
bool trip_reader_probe(const trip_dataset *d, trip_engine engine, void *memory);

/* The length of slots of at least `wanted` bytes (0: 512 KiB a plane): whole pages, and room for
 * the largest run that the data set can have. */
size_t trip_reader_slot_bytes(const trip_dataset *d, unsigned planes, size_t wanted);

typedef struct trip_reader trip_reader;

int trip_reader_create(trip_reader **out, const trip_dataset *d, const trip_reader_params *params,
                       trip_budget *budget);
/* Waits for reads under way. */
void trip_reader_destroy(trip_reader *r);
/* For a renderer that has the splats already: nothing is read, and batches hold runs only,
 * from the next trip_reader_begin() on, which must follow. */
void trip_reader_set_runs_only(trip_reader *r, bool runs_only);
/* Starts a frame by reading a pass (NULL: none yet), which must stay there until it is over or
 * given up, and has at most as many selections as the data set has lists. Passes that are not over
 * are given up, without waiting: of reads under way nothing is handed out, counted or reported,
 * and their slots are used again as they end. All batches must have been released. */
int trip_reader_begin(trip_reader *r, const trip_pass *pass);
/* Another pass behind those begun, up to TRIP_READER_PASSES_MAX: it is read ahead while the last
 * batches of the one before it are drawn. */
int trip_reader_then(trip_reader *r, const trip_pass *pass);
/* 1: *batch is filled and its slot held until released; 0: all passes are over; negative: failed.
 */
int trip_reader_next(trip_reader *r, trip_batch *batch);
/* Issues reads for free slots, and waits until trip_reader_next() would not wait, at most for the
 * timeout; UINT64_MAX: without end. False when the time is over or the work is interrupted. */
bool trip_reader_await(trip_reader *r, uint64_t timeout_ns);
void trip_reader_release(trip_reader *r, trip_batch *batch);
/* Ring length. */
unsigned trip_reader_slots(const trip_reader *r);
/* Whether the slots are the caller's memory. */
bool trip_reader_in_place(const trip_reader *r);
/* Since trip_reader_begin(). */
trip_reader_stats trip_reader_get_stats(const trip_reader *r);
/* Of its bytes_read, those of a list, by its number in the data set. */
uint64_t trip_reader_list_bytes(const trip_reader *r, unsigned list);
/* "io_uring", "io_uring+O_DIRECT", "pread", "pread+O_DIRECT" or "null". */
const char *trip_reader_engine_name(const trip_reader *r);

#endif
