/* A hash of everything that the bytes of a data set depend on: the names and the state of all files
 * that the volume is read from, and all parameters but memory and threads. A run may resume an
 * interrupted one of the same identity. One thread. */
#ifndef TRIP_IDENTITY_H
#define TRIP_IDENTITY_H

#include "brick.h"
#include "transfer_function.h"

/* `functions` are those of the parameters, as loaded. Reports failures. */
int trip_brick_identity(const trip_brick_params *p, trip_tf *const *functions, uint64_t *out);

/* All parameters but the input, memory and threads as text for free(), with the versions of the
 * bricker and of the format. Loads the functions that the parameters name. */
int trip_brick_options_text(const trip_brick_params *p, char **out);

#endif
