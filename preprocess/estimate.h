/* Estimates the needs of a run of `brick` from a sample of the volume, and checks the free disk
 * space. One thread. */
#ifndef TRIP_ESTIMATE_H
#define TRIP_ESTIMATE_H

#include "brick_input.h"
#include "brick_memory.h"

/* The expected size and duration of a run. */
typedef struct trip_brick_estimate {
    uint64_t voxels, kept, halo;
    uint64_t bytes, temporary_bytes; /* bytes needed on the output's disk */
    uint64_t free_bytes;             /* bytes free on the output's disk */
    double seconds;
} trip_brick_estimate;

/* Estimates a run from a sample of the volume, without writing a data set. */
int trip_brick_estimate_make(const trip_brick_params *params, trip_brick_estimate *estimate);

/* Checks that the disk and the cache can hold the data set. A clear lack of space is a reported
 * failure. Reads a sample of the volume only if the maximum possible size does not fit. */
int trip_estimate_check_disk(trip_brick_input *in, const trip_piece_format *format,
                             const trip_memory_plan *plan);

#endif
