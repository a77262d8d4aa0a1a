/* Several data sets as one, which are drawn in one picture: its lists are theirs at level 0, and a
 * pass merges them by list coordinate. They are on one grid and have one scale of codes, as regions
 * of a volume do (`brick --region`); a voxel may be in several of them, as halo of one and splat of
 * another. It shares everything with them, and they must outlive it. */
#ifndef TRIP_DATASET_JOIN_H
#define TRIP_DATASET_JOIN_H

#include "dataset.h"

/* Fails (reported, with the name of the data set that does not go with the others) where they have
 * different grids, codes, normals or tiles, or more lists in all than one may have, or where the
 * last keeps voxels that one before it keeps: those before have been joined before. */
int trip_dataset_join(trip_dataset **out, trip_dataset *const *parts, unsigned count,
                      trip_budget *budget);
void trip_dataset_join_close(trip_dataset *d);

#endif
