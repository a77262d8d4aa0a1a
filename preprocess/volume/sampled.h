/* A reader of every n-th voxel of another reader's volume along each axis, starting with the first
 * voxel. It gives a small preview of a volume in little time. The thread rules of volume_reader.h
 * hold. */
#ifndef TRIP_SAMPLED_H
#define TRIP_SAMPLED_H

#include "volume_reader.h"

/* Wraps an opened reader so that the volume has at most `max_voxels` voxels. Replaces *reader,
 * *state and *info. Changes nothing if the volume is small enough, or on failure. Reports failures.
 */
int trip_sampled_wrap(const trip_volume_reader **reader, void **state, trip_volume_info *info,
                      uint64_t max_voxels, trip_budget *budget);

#endif
