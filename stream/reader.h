/* Reads the selected runs of lists from disk into the slots of a ring, and hands them out in draw
 * order. Every page is checked against its checksum first. One thread calls begin, next and
 * release. The engine's threads share only the ring with it. The picture must not depend on any
 * parameter. */
#ifndef TRIP_READER_H
#define TRIP_READER_H

#include "batch.h"
#include "task_runner.h"

#define TRIP_READER_PASSES_MAX 8

typedef enum trip_engine {
    TRIP_ENGINE_AUTO,  /* io_uring if the kernel allows it, otherwise pread */
    TRIP_ENGINE_URING, /* fails if the kernel does not allow it */
    TRIP_ENGINE_PREAD, /* threads */
    /* Reads everything into memory at creation. Batches lie in that memory, or are copied to the
     * caller's slots. Gives the same picture without the disk, to measure drawing alone. */
    TRIP_ENGINE_NULL,
} trip_engine;

/* Zero selects the default. */
typedef struct trip_reader_params {
    trip_engine engine;
    /* One bit per trip_plane; voxels always. Normals that the data set does not store are computed,
     * in passes with trip_pass.around. */
    unsigned planes;
    unsigned slots; /* length of the ring, at least 2; default 8 */
    /* Size of a slot for all planes, from trip_reader_slot_bytes(). Slots hold whole runs. */
    size_t slot_bytes;
    /* Gaps up to this size are read through. At least a page; default 32 KiB. */
    size_t gap_bytes;
    unsigned threads; /* for reading (pread) and checking; default 4 */
    bool buffered;    /* reads through the page cache instead of with O_DIRECT */
    /* Size of the cache of verified pages between frames, from the budget; 0 means no cache. */
    size_t cache_bytes;
    /* The caller's memory for the slots: `slots` pointers, aligned to 4096 bytes, to slot_bytes
     * each. slot_bytes is a multiple of the page size and large enough for any run. Reads go there
     * until trip_reader_destroy() returns. NULL takes the memory from the budget. */
    void *const *slot_memory;
    /* Called right before the bytes of a run are requested, on the thread that calls begin and
     * next. Returning true leaves the run out, since it has no effect, such as when opaque pixels
     * occlude it. Runs of selections with `ahead` also have an effect on the runs beside them. */
    bool (*skip)(void *user, const trip_selection *s, const trip_run *run);
    void *skip_user;
    /* Runs the checks of blocks. The thread that calls next calls the runner. */
    trip_task_runner runner;
    /* For tests. Called on any engine thread after a read put bytes at `data`, from `offset` on,
     * with its result (a count or -errno). Returns the result to continue with. May wait and change
     * the bytes. */
    long (*fault)(void *user, void *data, uint64_t offset, size_t bytes, long result);
    void *fault_user;
} trip_reader_params;

typedef struct trip_reader_stats {
    uint64_t bytes_read, reads; /* from disk, for slots handed out */
    uint64_t bytes_cached;      /* from the cache instead */
    uint64_t splats;            /* handed out */
    uint64_t runs_skipped,
        bytes_skipped;   /* by the skip callback; includes gaps that are read through */
    uint64_t wait_ns;    /* time spent waiting for the disk */
    uint64_t normals_ns; /* time spent computing normals */
} trip_reader_stats;

/* Whether the engine can read into memory that does not belong to the process, such as a driver's
 * mapping, and whether the bytes can be read back. Tries this with the first page of the data set,
 * bypassing the page cache if possible. The memory has room for a page and is aligned to 4096
 * bytes. Reports nothing. */
bool trip_reader_probe(const trip_dataset *d, trip_engine engine, void *memory);

/* Returns a size of at least `wanted` bytes for a slot; 0 means 512 KiB per plane. It has whole
 * pages, and room for the largest run of the data set. */
size_t trip_reader_slot_bytes(const trip_dataset *d, unsigned planes, size_t wanted);

typedef struct trip_reader trip_reader;

int trip_reader_create(trip_reader **out, const trip_dataset *d, const trip_reader_params *params,
                       trip_budget *budget);
/* Waits for running reads. */
void trip_reader_destroy(trip_reader *r);
/* For a renderer that already has the splats: batches then hold runs only, and nothing is read.
 * Takes effect at the next trip_reader_begin(), which must follow. */
void trip_reader_set_runs_only(trip_reader *r, bool runs_only);
/* Starts a frame with a pass, or NULL for none yet. The pass must exist until it is over or given
 * up, and has at most as many selections as the data set has lists. Unfinished passes are given up
 * without waiting: their reads are not handed out, counted or reported, and their slots become free
 * as the reads end. All batches must have been released. */
int trip_reader_begin(trip_reader *r, const trip_pass *pass);
/* Adds a pass after the passes already begun, at most TRIP_READER_PASSES_MAX. It is read ahead
 * while the last batches of the pass before it are drawn. */
int trip_reader_then(trip_reader *r, const trip_pass *pass);
/* Returns 1 if *batch is filled, with its slot held until released. Returns 0 if all passes are
 * over, or a negative status. */
int trip_reader_next(trip_reader *r, trip_batch *batch);
/* Requests reads for free slots. Then waits until trip_reader_next() would not wait, at most for
 * the timeout; UINT64_MAX sets none. Returns false after the timeout or an interruption. */
bool trip_reader_await(trip_reader *r, uint64_t timeout_ns);
void trip_reader_release(trip_reader *r, trip_batch *batch);
/* Returns the length of the ring, or 1 if normals are computed: then one batch is handed out at a
 * time. */
unsigned trip_reader_slots(const trip_reader *r);
/* Whether the slots are the caller's memory. */
bool trip_reader_in_place(const trip_reader *r);
/* Returns statistics since trip_reader_begin(). */
trip_reader_stats trip_reader_get_stats(const trip_reader *r);
/* Returns the bytes_read of one list, by its index in the data set. */
uint64_t trip_reader_list_bytes(const trip_reader *r, unsigned list);
/* Returns "io_uring", "io_uring+O_DIRECT", "pread", "pread+O_DIRECT" or "null". */
const char *trip_reader_engine_name(const trip_reader *r);

#endif
