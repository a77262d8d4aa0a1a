/* The halo of a coarse level's values. Interpolation about a coarse voxel that covers kept voxels
 * needs all 26 beside it. But the halo of level 0 reaches no farther than a voxel of level 0, and
 * some of the 26 cover none of it. These are added, with a value that does not show: the least of
 * `around` (coarse.h) in the voxels beside them that cover kept ones. They are no part of the next
 * level, in which they would count for something that is not known. */
#ifndef TRIP_LEVEL_HALO_H
#define TRIP_LEVEL_HALO_H

#include "level_positions.h"

/* Copies a file of trip_level_file_append(), with means or without, into one without, and adds the
 * halo there; `round`: codes are turned round in `around`. `from` is flushed, `to` is to be. One
 * thread. */
int trip_level_halo_add(const trip_output *from, bool means, bool round, trip_output *to,
                        const int64_t dims[3], unsigned edge_log2, trip_budget *budget);

/* What that takes of the budget, at most, of a level of at most so many voxels. */
uint64_t trip_level_halo_bytes(const int64_t dims[3], unsigned edge_log2, uint64_t voxels);

#endif
