/* Estimates what a run of `brick` needs, from a sample of the volume, and checks that the disk can
 * hold it. One thread. */
#ifndef TRIP_ESTIMATE_H
#define TRIP_ESTIMATE_H

#include "brick_input.h"
#include "brick_memory.h"

/* A reported failure if the disk, or the cache that the output is for, clearly cannot hold the data
 * set. Reads a sample of the volume only if the most that it could need does not fit. */
int trip_estimate_check_disk(trip_brick_input *in, const trip_piece_format *format,
                             const trip_memory_plan *plan);

#endif
