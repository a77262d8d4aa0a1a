/* Finds the visible extent of an object: a small picture of opacity only, summed from a coarse
 * level, or from the finest level of small data sets. Optical depths are added as integers, so that
 * the result is the same for any tiles, slots and threads. One thread at a time.
 *
 * A pixel is visible if its opacity is at least TRIP_OUTLINE_OPACITY. Parts narrower than a pixel
 * may be missing: visible.h finds single visible voxels. */
#ifndef TRIP_OUTLINE_H
#define TRIP_OUTLINE_H

#include "camera.h"
#include "reader.h"
#include "transfer_function.h"

/* A convex function of a position p: along . (p - o) + around * (distance of p from the axis
 * through o). o is the origin. World space and units; around >= 0. */
typedef struct trip_reach {
    trip_vec3 along;
    double around;
} trip_reach;

enum { TRIP_REACHES_MAX = 8 };

/* The origin and axis of reaches. */
typedef struct trip_reach_origin {
    trip_vec3 index; /* o, in index space */
    trip_vec3 axis;  /* world direction, unit length; required if any `around` is not zero */
} trip_reach_origin;

#define TRIP_OUTLINE_OPACITY (8.0 / 255)

typedef struct trip_outline trip_outline;

typedef struct trip_outline_params {
    const trip_dataset *data;
    trip_reader *reader; /* reads voxels; no pass in progress */
    trip_budget *budget;
    const trip_tf_entry *table;     /* filled for the data set */
    double lo[3], hi[3];            /* index-space box to examine */
    const trip_camera_params *view; /* from outside the box; size and angle are ignored */
} trip_outline_params;

/* Finds the outline. *out is NULL if nothing is visible or no level is small enough. */
int trip_outline_make(trip_outline **out, const trip_outline_params *params);
void trip_outline_destroy(trip_outline *o);

/* Sets values[i] to the maximum of wanted[i], for i < count <= TRIP_REACHES_MAX: over the visible
 * pixels, from the nearest to the farthest visible depth of each pixel. */
void trip_outline_reach(const trip_outline *o, const trip_reach_origin *origin,
                        const trip_reach *wanted, int count, double *values);

/* Returns the number of voxels examined. */
uint64_t trip_outline_splats(const trip_outline *o);

#endif
