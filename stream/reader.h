/* Streams the selected runs of a list from disk into slots of a ring and hands them out in draw
 * order. Every page is checked against its checksum before it is handed out. One thread calls
 * begin, next and release; the engine's own threads meet it at the ring only. The picture must not
 * depend on anything set here. */
#ifndef TRIP_READER_H
#define TRIP_READER_H

#include "selection.h"

typedef enum trip_engine {
    TRIP_ENGINE_AUTO,  /* io_uring where the kernel allows it, else pread */
    TRIP_ENGINE_URING,
    TRIP_ENGINE_PREAD, /* threads */
} trip_engine;

/* Zero means the default. */
typedef struct trip_reader_params {
    trip_engine engine;
    unsigned planes;        /* bit per trip_plane; voxels always */
    unsigned slots;         /* ring length, default 8 */
    size_t slot_bytes;      /* per plane, a multiple of the page size; default 1 MiB */
    unsigned threads;       /* pread engine, default 4 */
    /* Asked before a run's bytes are requested: true = leave it out (it lies behind what is already
     * saturated). Called on the thread that calls trip_reader_next(). */
    bool (*skip)(void *user, const trip_selection *s, uint32_t brick);
    void *skip_user;
} trip_reader_params;

/* Runs ready to draw: run i has its splats at voxels[runs[i].first ...] and normals[...], `first`
 * now counting from the batch's own start. Runs are in draw order; in a descending pass each is
 * drawn last splat to first. A run may be split between two batches. */
typedef struct trip_batch {
    const trip_selection *selection;
    const uint32_t *voxels;
    const uint32_t *normals; /* NULL when that plane is not read */
    size_t splats;           /* length of the arrays above, holes included */
    const trip_run *runs;
    size_t run_count;
    void *slot;
} trip_batch;

typedef struct trip_reader_stats {
    uint64_t bytes_read, reads, splats, runs_skipped, bytes_skipped;
    uint64_t wait_ns; /* time next() waited for the disk */
} trip_reader_stats;

typedef struct trip_reader trip_reader;

int trip_reader_create(trip_reader **out, const trip_dataset *d, const trip_reader_params *params,
                       trip_budget *budget);
void trip_reader_destroy(trip_reader *r);
/* Starts reading; the selection must outlive the pass. */
int trip_reader_begin(trip_reader *r, const trip_selection *s);
/* 1: *batch is filled and its slot held until released; 0: the pass is over; negative: failed. */
int trip_reader_next(trip_reader *r, trip_batch *batch);
void trip_reader_release(trip_reader *r, trip_batch *batch);
/* Of the current or last pass. */
trip_reader_stats trip_reader_get_stats(const trip_reader *r);
/* "io_uring", "io_uring+O_DIRECT", "pread", ... */
const char *trip_reader_engine_name(const trip_reader *r);

#endif
