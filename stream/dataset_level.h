/* A data set as it is at one coarse level: its lists of values stand for level 0, on that level's
 * grid, so that what draws values interpolated at level 0 draws them. Lists keep their numbers. It
 * shares everything with the data set, which must outlive it. */
#ifndef TRIP_DATASET_LEVEL_H
#define TRIP_DATASET_LEVEL_H

#include "dataset.h"

/* No grid has a level beyond that has more than a voxel along any axis. */
enum { TRIP_DATASET_LEVELS_MAX = 31 };

/* How many coarse levels have lists of a kind along each axis, without a gap: those that are drawn.
 */
unsigned trip_dataset_levels(const trip_dataset *d, trip_kind kind);

/* `level`: from 1 to the number of those that have values. */
int trip_dataset_level_open(trip_dataset **out, const trip_dataset *d, unsigned level);
void trip_dataset_level_close(trip_dataset *d);

#endif
