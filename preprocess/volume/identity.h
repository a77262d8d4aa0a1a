/* Computes the identity of a run: a hash of everything that determines the bytes of its data set.
 * These are the names and state of all input files, and all parameters except memory and threads. A
 * run can resume an interrupted run with the same identity. One thread. */
#ifndef TRIP_IDENTITY_H
#define TRIP_IDENTITY_H

#include "brick_params.h"
#include "transfer_function.h"

/* Computes the identity. `functions` are the loaded transfer functions of the parameters. Reports
 * failures. */
int trip_brick_identity(const trip_brick_params *p, trip_tf *const *functions, uint64_t *out);

/* Returns all parameters except input, memory and threads as text, for free(), with the versions of
 * the bricker and the format. Loads the transfer functions that the parameters name. */
int trip_brick_options_text(const trip_brick_params *p, char **out);

#endif
