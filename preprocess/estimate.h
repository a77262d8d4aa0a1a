/* What a run of `brick` will take, from a look at some blocks of the volume; and whether the disk
 * can hold it. */
#ifndef TRIP_ESTIMATE_H
#define TRIP_ESTIMATE_H

#include "brick_input.h"
#include "brick_memory.h"

/* Refuses to begin what the disk clearly cannot hold. Looks at the volume only if what it might
 * need at most is more than there is. */
int trip_estimate_check_disk(trip_brick_input *in, const trip_piece_format *format,
                             const trip_memory_plan *plan);

#endif
