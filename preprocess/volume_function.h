/* The function that a volume would be bricked with, without bricking it. */
#ifndef TRIP_VOLUME_FUNCTION_H
#define TRIP_VOLUME_FUNCTION_H

#include "brick.h"

/* In data units: the first of the functions that the parameters name, or the automatic one where
 * they name none. Reads the volume once where it takes that. */
int trip_volume_function(const trip_brick_params *params, trip_tf **out);

#endif
