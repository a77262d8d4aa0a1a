/* What the disk gives a program that only reads: files from end to end, past the page cache, in
 * large transfers, several at once. */
#ifndef TRIP_BENCH_DISK_H
#define TRIP_BENCH_DISK_H

#include "library_session.h"

/* Plane files of a data set's lists. */
typedef struct bench_files {
    uint8_t planes[TRIP_LISTS_MAX]; /* of a list, by its number: a bit per trip_plane */
} bench_files;

/* The files that a plan's passes read from. */
void bench_files_of_plan(const trip_dataset *data, const trip_plan *plan, bench_files *out);

/* Advises the system to drop what it holds of them; direct reads do not need that. */
void bench_files_forget(const session *s, const bench_files *files);

typedef struct bench_disk_read {
    double ms;
    uint64_t bytes;
    bool direct; /* O_DIRECT was not refused */
} bench_disk_read;

/* What is compared with the ring has the same kind of pages and the same work. */
typedef enum bench_plain {
    BENCH_PLAIN, /* into large pages, which the ring is in where the system has them, and a byte
                    of every cache line is loaded, as checking and drawing do */
    BENCH_PLAIN_BLIND, /* the same, and nothing is loaded */
    BENCH_PLAIN_SMALL, /* nothing loaded, into memory as the system gives it to any program */
} bench_plain;

int bench_files_read(const session *s, const bench_files *files, bench_plain how,
                     bench_disk_read *out);

/* The same bytes as the reader streams them: every splat of the files' lists, those of an axis
 * merged by list coordinate, checked against its checksum and handed out, and not drawn. The reader
 * reads the files' planes and skips nothing. */
int bench_files_stream(const session *s, const bench_files *files, trip_reader *reader,
                       bench_disk_read *out);

#endif
