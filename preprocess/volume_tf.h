/* The transfer function that a volume would be bricked with, without bricking it. One thread. */
#ifndef TRIP_VOLUME_TF_H
#define TRIP_VOLUME_TF_H

#include "brick.h"

/* *out, for trip_tf_destroy(), is in data units: the first function that the parameters name, or
 * the automatic one where they name none. Reads the whole volume where that depends on its values.
 */
int trip_volume_tf(const trip_brick_params *params, trip_tf **out);

#endif
