/* Presents a data set without normals as one with normals of 4 bytes. Readers compute these normals
 * from values while they read (computed_normals.h). The result shares all memory with the data set,
 * which must outlive it. */
#ifndef TRIP_DATASET_NORMALS_H
#define TRIP_DATASET_NORMALS_H

#include "dataset.h"

/* Opens the data set with computed normals. The data set stores no normals. */
int trip_dataset_normals_open(trip_dataset **out, const trip_dataset *d, trip_budget *budget);
void trip_dataset_normals_close(trip_dataset *d);

/* Whether the gradients of a level are differences of the values of a kind of list. Level 0 has
 * voxels and halo. Coarse levels have values, or means if the data set has no values there. */
bool trip_dataset_has_gradients_of(const trip_dataset *d, const trip_list *list);

#endif
