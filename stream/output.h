/* A file written in order and in large pieces, with an optional checksum per page. One thread at a
 * time writes; several threads may read flushed bytes. Failures are reported with the file's name.
 * Outputs that share `failed` report only the first failure, since a full disk makes all of them
 * fail. */
#ifndef TRIP_OUTPUT_H
#define TRIP_OUTPUT_H

#include "budget.h"
#include "flusher.h"

#include <stdatomic.h>

typedef struct trip_output {
    /* -1 if closed, and for an unnamed file while its buffer holds all bytes. */
    int fd;
    char *path;
    trip_budget *budget;
    /* With a flusher, two buffers of buffer_bytes: one is filled while the other is written. */
    unsigned char *buffer;
    size_t buffer_bytes, used_bytes;
    unsigned filling; /* index of the buffer being filled */
    trip_flusher *flusher;
    trip_flush_job job;
    atomic_bool *failed;
    uint64_t bytes;                /* appended so far */
    size_t page_bytes;             /* divides buffer_bytes; 0 means no checksums */
    struct trip_output *checksums; /* receives the XXH64 of every page */
} trip_output;

/* Zero means none. */
typedef struct trip_output_params {
    const char *folder, *name; /* TRIP_SPOOL_NAME for an unnamed file */
    size_t buffer_bytes;       /* a multiple of 4096 */
    uint64_t skip_bytes;       /* left out at the start, for trip_output_patch() */
    /* Writes full buffers, bypassing the page cache if possible. */
    trip_flusher *flusher;
    size_t page_bytes;
    trip_output *checksums;
    atomic_bool *failed; /* set at the first failure to write, by any thread */
    /* The file is created when the buffer is full, and disappears when closed. */
    bool unnamed;
} trip_output_params;

int trip_output_create(trip_output *o, const trip_output_params *params, trip_budget *budget);
int trip_output_append(trip_output *o, const void *data, size_t bytes);
/* Appends all bytes of `from`, which must be flushed. `from` does not change. */
int trip_output_append_output(trip_output *o, trip_output *from);
/* Appends zeros up to the next multiple of `alignment` bytes, at most 64. */
int trip_output_align(trip_output *o, size_t alignment);
/* Writes the buffered bytes. A short last page gets its checksum now, so no bytes may follow. An
 * unnamed file that fits into the buffer is not written. */
int trip_output_flush(trip_output *o);
/* Gives an empty unnamed file its length. Several threads may then patch different parts of it. */
int trip_output_reserve(trip_output *o, uint64_t bytes);
/* Reads back flushed bytes. */
int trip_output_read(const trip_output *o, uint64_t offset, void *data, size_t bytes);
/* Tells the system that these bytes will be read soon. */
void trip_output_announce_read(const trip_output *o, uint64_t offset, uint64_t bytes);
int trip_output_patch(const trip_output *o, uint64_t offset, const void *data, size_t bytes);
/* Lets a flusher sync the file. trip_output_sync() then waits for it. No bytes may follow. */
int trip_output_start_sync(trip_output *o);
int trip_output_sync(trip_output *o);
/* Closes the file and frees *o. An output of all zeros is allowed. */
void trip_output_close(trip_output *o);

#endif
