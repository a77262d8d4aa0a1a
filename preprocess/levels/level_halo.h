/* Adds the halo of a coarse level's values. Interpolation around a coarse voxel that covers kept
 * voxels needs all 26 neighbours. Some neighbours have no value, because the halo of level 0 is
 * only one voxel wide. Each gets an invisible value: the minimum of `around` (coarse.h) over its
 * own neighbours that cover kept voxels. The next level leaves them out, because their true values
 * are unknown. */
#ifndef TRIP_LEVEL_HALO_H
#define TRIP_LEVEL_HALO_H

#include "level_positions.h"

/* Copies a file of trip_level_file_append(), with or without means, into one without means, and
 * adds the halo. `round` means that `around` holds turned codes. `from` must be flushed; the caller
 * flushes `to`. One thread. */
int trip_level_halo_add(const trip_output *from, bool means, bool round, trip_output *to,
                        const int64_t dims[3], unsigned edge_log2, trip_budget *budget);

/* Returns the maximum memory for a level of at most `voxels` voxels. */
uint64_t trip_level_halo_bytes(const int64_t dims[3], unsigned edge_log2, uint64_t voxels);

#endif
