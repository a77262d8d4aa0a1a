/* Estimates how long a disk takes to read the files of a volume and to write a data set, by small
 * trials that bypass the page cache. One thread. */
#ifndef TRIP_DISK_TIME_H
#define TRIP_DISK_TIME_H

#include <stdint.h>

/* Reading a volume once or twice. */
typedef struct trip_read_cost {
    uint64_t bytes;          /* of all files */
    uint64_t uncached_bytes; /* of them not in the page cache */
    uint64_t cache_bytes;    /* memory that can hold files between two passes */
    double seconds_per_byte; /* of the disk */
    double compute_seconds;  /* of all passes, while the disk reads ahead */
    int passes;
} trip_read_cost;

/* Returns the longer one of computing and reading. The first pass reads the uncached bytes. Later
 * passes read all bytes again if the page cache cannot hold them. */
double trip_disk_time_read(const trip_read_cost *cost);

/* Estimates the bytes of a file that are not in the page cache, from samples. Returns 0 if the
 * system does not tell. */
uint64_t trip_disk_time_uncached(const char *path);

/* Returns the seconds per byte of reading a file, or 0 if it is not on a disk. */
double trip_disk_time_reading(const char *path);
/* Returns the seconds per byte of writing an unnamed file into the folder of `path`. */
double trip_disk_time_writing(const char *path);

#endif
