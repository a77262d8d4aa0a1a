/* Threads that write buffers to files while other threads fill the next buffers, and that sync
 * files. A job belongs to the flusher from submit to wait. One thread submits a job and waits for
 * it. */
#ifndef TRIP_FLUSHER_H
#define TRIP_FLUSHER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct trip_flusher trip_flusher;

typedef struct trip_flush_job {
    int fd;
    const void *data; /* NULL syncs the file instead */
    size_t bytes;
    uint64_t offset;
    struct trip_flush_job *next;
    bool pending; /* guarded by the flusher's lock */
    int error;    /* errno; 0 after success */
} trip_flush_job;

/* Returns 0 or an errno. Reports nothing. */
int trip_flusher_create(trip_flusher **out);
/* No job may be pending. */
void trip_flusher_destroy(trip_flusher *f);
void trip_flusher_submit(trip_flusher *f, trip_flush_job *job);
/* Waits until the job, if submitted, is done. Returns its error. */
int trip_flusher_wait(trip_flusher *f, trip_flush_job *job);

/* Writes all bytes at the offset on this thread. Returns 0 or an errno. If direct writing is
 * refused, this and later writes go through the page cache. */
int trip_flusher_write(int fd, const void *data, size_t bytes, uint64_t offset);

#endif
