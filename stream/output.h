/* A file being written in order, in large pieces, with a checksum for every page if wanted. One
 * thread at a time; what is flushed may be read by several at once. Failures are reported here with
 * the file's name, and only the first one of outputs that share `failed`: what fills a disk fails
 * in all of them. */
#ifndef TRIP_OUTPUT_H
#define TRIP_OUTPUT_H

#include "budget.h"
#include "flusher.h"

#include <stdatomic.h>

typedef struct trip_output {
    int fd; /* -1 when closed, and of an unnamed file while all of it is in the buffer */
    char *path;
    trip_budget *budget;
    unsigned char *buffer; /* with a flusher, two of buffer_bytes: one is filled, one written */
    size_t buffer_bytes, used_bytes;
    unsigned filling; /* which of the two */
    trip_flusher *flusher;
    trip_flush_job job;
    atomic_bool *failed;
    uint64_t bytes;                /* appended so far */
    size_t page_bytes;             /* divides buffer_bytes; 0: no checksums */
    struct trip_output *checksums; /* gets the XXH64 of every page */
} trip_output;

/* Zero means none. */
typedef struct trip_output_params {
    const char *folder, *name; /* of an unnamed file TRIP_SPOOL_NAME */
    size_t buffer_bytes;       /* a multiple of 4096 */
    uint64_t skip_bytes;       /* left out at the start, for trip_output_patch() */
    trip_flusher *flusher; /* full buffers are written by it, past the page cache where possible */
    size_t page_bytes;
    trip_output *checksums;
    atomic_bool *failed; /* set at the first failure to write, any thread */
    bool unnamed; /* there is no file before the buffer is full, and it is gone when closed */
} trip_output_params;

int trip_output_create(trip_output *o, const trip_output_params *params, trip_budget *budget);
int trip_output_append(trip_output *o, const void *data, size_t bytes);
/* Appends all of `from`, which is flushed and stays as it is. */
int trip_output_append_output(trip_output *o, trip_output *from);
/* Zeros up to the next multiple of `alignment` bytes, at most 64. */
int trip_output_align(trip_output *o, size_t alignment);
/* Writes what is buffered; a short last page gets its checksum now, so nothing may follow it. Of an
 * unnamed file that the buffer holds nothing is written. */
int trip_output_flush(trip_output *o);
/* Reads back what has been flushed. */
int trip_output_read(const trip_output *o, uint64_t offset, void *data, size_t bytes);
int trip_output_patch(trip_output *o, uint64_t offset, const void *data, size_t bytes);
/* Has a flusher see to it that all is on the disk, which trip_output_sync() then waits for; nothing
 * may follow. */
int trip_output_start_sync(trip_output *o);
int trip_output_sync(trip_output *o);
/* Closes and frees, also what was never opened (all zero). */
void trip_output_close(trip_output *o);

#endif
