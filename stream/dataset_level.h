/* Presents a coarse level as a data set. Its lists of values stand for level 0, on the level's
 * grid, so code that draws interpolated values at level 0 can draw them. Lists keep their indices.
 * It shares all memory with the data set, which must outlive it. */
#ifndef TRIP_DATASET_LEVEL_H
#define TRIP_DATASET_LEVEL_H

#include "dataset.h"

/* Any grid has at most one voxel along each axis at this level. */
enum { TRIP_DATASET_LEVELS_MAX = 31 };

/* Returns the number of coarse levels that have lists of a kind along each axis, without a gap.
 * These levels are drawn. */
unsigned trip_dataset_levels(const trip_dataset *d, trip_kind kind);

/* Opens a level, from 1 to the number of levels with values. */
int trip_dataset_level_open(trip_dataset **out, const trip_dataset *d, unsigned level);
void trip_dataset_level_close(trip_dataset *d);

#endif
