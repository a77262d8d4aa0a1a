/* A reader of every n-th voxel of another reader's volume along each axis, from the first one on: a
 * small volume of the same thing, soon read. As volume_reader.h says of threads. */
#ifndef TRIP_SAMPLED_H
#define TRIP_SAMPLED_H

#include "volume_reader.h"

/* Puts itself before an opened reader, so that the volume has at most so many voxels: *reader,
 * *state and *info are its own from then on; where it has no more anyway all stays as it is. A
 * reported failure leaves them as they are. */
int trip_sampled_wrap(const trip_volume_reader **reader, void **state, trip_volume_info *info,
                      uint64_t max_voxels, trip_budget *budget);

#endif
