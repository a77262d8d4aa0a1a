/* Joins several data sets for one picture. The joined data set has all their lists of level 0; a
 * pass merges these by list coordinate. The parts have one grid and one scale of codes, like
 * regions of a volume (`brick --region`). A voxel may be in several parts, as halo of one and splat
 * of another. The joined data set shares all memory with its parts, which must outlive it. */
#ifndef TRIP_DATASET_JOIN_H
#define TRIP_DATASET_JOIN_H

#include "dataset.h"

/* The advice of messages about data sets that cannot be joined. */
#define TRIP_JOIN_ADVICE                                                                           \
    "only regions of one volume, bricked alike, are drawn together (triptych brick --region); "    \
    "draw "                                                                                        \
    "other data sets in pictures of their own, with the same --eye, --look and --up"

/* Joins the parts. Reports a failure, with the name of the part at fault, in these cases:
 * - grids, codes, normals or tiles differ
 * - there are more than TRIP_LISTS_MAX lists
 * - the last part keeps voxels that an earlier part keeps; earlier parts were checked before */
int trip_dataset_join(trip_dataset **out, trip_dataset *const *parts, unsigned count,
                      trip_budget *budget);
void trip_dataset_join_close(trip_dataset *d);

#endif
