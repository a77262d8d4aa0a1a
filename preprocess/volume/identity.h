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

/* Return parameters as text, for free(). The first text has all parameters except the input,
 * memory, threads and the opacity envelope, and the versions of the bricker and the format. The
 * second text has the parameters of the opacity envelope, with the transfer functions, which it
 * loads. */
int trip_brick_form_text(const trip_brick_params *p, char **out);
int trip_brick_kept_text(const trip_brick_params *p, char **out);

#endif
