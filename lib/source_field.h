/* Reads the values of a volume itself for the integral renderer, instead of the values that a data
 * set keeps of it. */
#ifndef TRIP_SOURCE_FIELD_H
#define TRIP_SOURCE_FIELD_H

#include "dataset.h"
#include "field.h"
#include "volume.h"

/* Reads the volume. Its grid must equal the data set's grid, otherwise TRIP_ERROR (reported). In a
 * sparse volume, the neighbours of existing voxels have the background value. Values that are not
 * finite are left out. If the codes of the data set are even, the field has codes. Otherwise it has
 * values, and frames must set its unit. */
int trip_source_field_read(trip_field **out, const trip_dataset *data, const char *path,
                           const trip_volume_params *params, trip_budget *budget);

#endif
