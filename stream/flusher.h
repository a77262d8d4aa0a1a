/* Threads that write buffers to files while others fill the next ones, and see that files are on
 * the disk. A job belongs to the flusher from submit to wait; one thread submits and waits for a
 * job. */
#ifndef TRIP_FLUSHER_H
#define TRIP_FLUSHER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct trip_flusher trip_flusher;

typedef struct trip_flush_job {
    int fd;
    const void *data; /* NULL: what was written of the file goes to the disk */
    size_t bytes;
    uint64_t offset;
    struct trip_flush_job *next;
    bool pending; /* under the flusher's lock */
    int error;    /* errno, 0 when all is written */
} trip_flush_job;

/* 0 or an errno; nothing is reported. */
int trip_flusher_create(trip_flusher **out);
/* No job may be pending. */
void trip_flusher_destroy(trip_flusher *f);
void trip_flusher_submit(trip_flusher *f, trip_flush_job *job);
/* Waits until the job, if it was submitted, is done; returns its error. */
int trip_flusher_wait(trip_flusher *f, trip_flush_job *job);

/* All bytes at the offset, on this thread: 0 or an errno. Where direct writing is refused, the file
 * is written through the page cache from then on. */
int trip_flusher_write(int fd, const void *data, size_t bytes, uint64_t offset);

#endif
