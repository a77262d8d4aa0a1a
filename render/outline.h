/* What of an object is not too faint to see in a view of it: a small picture of opacity alone,
 * summed from a coarse level, or of small data sets from the finest. Optical depths add up in any
 * order, and are summed in whole numbers, so that it is the same for any tiles, slots and threads.
 * One thread.
 *
 * A pixel shows where its opacity is at least TRIP_OUTLINE_OPACITY. Things narrower than a pixel of
 * it may be missing: voxels that are seen alone are found by visible.h. */
#ifndef TRIP_OUTLINE_H
#define TRIP_OUTLINE_H

#include "framing.h"
#include "reader.h"
#include "transfer_function.h"

#define TRIP_OUTLINE_OPACITY (8.0 / 255)

typedef struct trip_outline trip_outline;

typedef struct trip_outline_params {
    const trip_dataset *data;
    trip_reader *reader; /* of voxels, no pass under way */
    trip_budget *budget;
    const trip_tf_entry *table;     /* as filled for the data set */
    double lo[3], hi[3];            /* the box of index space that is looked at */
    const trip_camera_params *view; /* from outside of the box; its size and angle do not count */
} trip_outline_params;

/* *out is NULL where nothing shows, or the data set has no level that is small enough. */
int trip_outline_make(trip_outline **out, const trip_outline_params *params);
void trip_outline_destroy(trip_outline *o);

/* As trip_camera_framing.reach, over what shows: from the nearest to the farthest of what is in a
 * pixel. */
void trip_outline_reach(const trip_outline *o, const trip_reach_origin *origin,
                        const trip_reach *wanted, int count, double *values);

/* Voxels looked at. */
uint64_t trip_outline_splats(const trip_outline *o);

#endif
