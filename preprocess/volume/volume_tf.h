/* Returns the transfer function that bricking a volume would use, without bricking it. One thread.
 */
#ifndef TRIP_VOLUME_TF_H
#define TRIP_VOLUME_TF_H

#include "brick_params.h"

/* Sets *out to the first transfer function in the parameters, or to an automatic one if there is
 * none. It is in data units; free it with trip_tf_destroy(). Reads the whole volume if the transfer
 * function depends on the values. */
int trip_volume_tf(const trip_brick_params *params, trip_tf **out);

#endif
