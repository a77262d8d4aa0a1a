/* Estimates the needs of a run of `brick` from a sample of the volume, and checks the free disk
 * space. One thread. */
#ifndef TRIP_ESTIMATE_H
#define TRIP_ESTIMATE_H

#include "brick_input.h"
#include "brick_memory.h"

/* Checks that the disk and the cache can hold the data set. A clear lack of space is a reported
 * failure. Reads a sample of the volume only if the maximum possible size does not fit. */
int trip_estimate_check_disk(trip_brick_input *in, const trip_piece_format *format,
                             const trip_memory_plan *plan);

#endif
