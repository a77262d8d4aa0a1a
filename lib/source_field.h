/* The values of a volume as the integral renderer takes them: all of them, as its file gives them,
 * in the place of those that a data set made of it keeps. */
#ifndef TRIP_SOURCE_FIELD_H
#define TRIP_SOURCE_FIELD_H

#include "dataset.h"
#include "field.h"
#include "volume.h"

/* Reads the volume, which must have the grid of the data set. Of a sparse one, voxels beside those
 * that exist are there too, with the background's value. Values that are not finite are left out.
 */
int trip_source_field_read(trip_field **out, const trip_dataset *data, const char *path,
                           const trip_volume_params *params, trip_budget *budget);

#endif
