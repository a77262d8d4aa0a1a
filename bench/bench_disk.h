/* Measures the bandwidth of the disk for a program that only reads. It reads whole files past the
 * page cache, in large transfers by several threads. One thread calls it. */
#ifndef TRIP_BENCH_DISK_H
#define TRIP_BENCH_DISK_H

#include "library_session.h"

/* The plane files of a data set's lists. */
typedef struct bench_files {
    uint8_t planes[TRIP_LISTS_MAX]; /* of each list by its index: a bit per trip_plane */
} bench_files;

/* Finds the files that the passes of a plan read. */
void bench_files_of_plan(const trip_dataset *data, const trip_plan *plan, bench_files *out);

/* Advises the kernel to drop cached pages of the files. Direct reads do not need this. */
void bench_files_forget(const session *s, const bench_files *files);

typedef struct bench_disk_read {
    double ms;
    uint64_t bytes;
    bool direct; /* O_DIRECT worked */
} bench_disk_read;

/* Kinds of plain reads. A read compared to the ring has the same kind of pages and the same
 * work. */
typedef enum bench_plain {
    BENCH_PLAIN, /* into large pages like the ring's, if the system has them, and loads a byte of
                    every cache line, as checking and drawing do */
    BENCH_PLAIN_BLIND, /* into large pages, without loading */
    BENCH_PLAIN_SMALL, /* into pages of the default size, without loading */
} bench_plain;

int bench_files_read(const session *s, const bench_files *files, bench_plain how,
                     bench_disk_read *out);

/* Reads the same files by the reader. It merges the lists of each axis by list coordinate, verifies
 * checksums, hands out every splat and draws nothing. `reader` reads the planes of the files and
 * skips nothing. */
int bench_files_stream(const session *s, const bench_files *files, trip_reader *reader,
                       bench_disk_read *out);

#endif
