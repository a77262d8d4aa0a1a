/* A quick look at a volume's values, in bounded time and memory whatever its size. One thread. */
#ifndef TRIP_GLANCE_H
#define TRIP_GLANCE_H

#include "volume.h"

typedef struct trip_glance {
    double share; /* of the volume that was read, above 0; 1 for all of it */
    double value_min, value_max, typical_min, typical_max; /* of the values that were read */
    trip_fills fills; /* values among them that stand for "no value" */
} trip_glance;

/* Reads slices at even distances, or the first portions of a sparse volume, for about a second. The
 * volume must just have been opened. Returns 0 and a share of 0 if no value could be read in this
 * time or memory, or if no value is finite. Reports failures. */
int trip_glance_at(trip_glance *out, trip_volume *volume, const char *path, trip_budget *budget);

#endif
