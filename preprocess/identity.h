/* A number for everything that the bytes of a data set depend on: the input file and the parameters
 * but for memory and threads. Runs of one identity may go on from each other. */
#ifndef TRIP_IDENTITY_H
#define TRIP_IDENTITY_H

#include "brick.h"
#include "transfer_function.h"

/* `functions` as they were loaded. Fails when memory runs out. */
int trip_brick_identity(const trip_brick_params *p, trip_tf *const *functions, uint64_t *out);

/* All parameters but the input, memory and threads as text, with the versions of the bricker and of
 * the format, for free(); the functions are loaded. */
int trip_brick_options_text(const trip_brick_params *p, char **out);

#endif
