/* Finds the visible extent of an object: the visible voxels of a coarse level, or of the finest
 * level of small data sets. The result is one set of voxels for all directions of view, so a view
 * that fits it changes as little as its direction. One thread at a time.
 *
 * A coarse voxel is visible if, in all but one of seven directions, a ray through it has an opacity
 * of at least TRIP_OUTLINE_OPACITY. The directions are the axes and diagonals of the grid. The rays
 * sum the voxels of one line as integers, so that the result is the same for any tiles, slots and
 * threads. Details narrower than a coarse voxel may be missing: visible.h finds single visible
 * voxels. */
#ifndef TRIP_OUTLINE_H
#define TRIP_OUTLINE_H

#include "camera.h"
#include "code_set.h"
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

/* Returns the codes that count in the visible extent. These are the codes of typical values
 * (format.h). All codes count if no typical value has an extinction of at least `min`. A hot voxel
 * beside an object does not make the object smaller. */
trip_code_range trip_outline_codes(const trip_dataset *data, const trip_tf_entry *table,
                                   double min);

typedef struct trip_outline trip_outline;

typedef struct trip_outline_params {
    const trip_dataset *data;
    trip_reader *reader; /* reads voxels; no pass in progress */
    trip_budget *budget;
    const trip_tf_entry *table; /* filled for the data set */
    double min_extinction;      /* fainter voxels do not count */
} trip_outline_params;

/* Finds the outline. *out is NULL if nothing is visible or no level is small enough. */
int trip_outline_make(trip_outline **out, const trip_outline_params *params);
void trip_outline_destroy(trip_outline *o);

/* Sets values[i] to the maximum of wanted[i], for i < count <= TRIP_REACHES_MAX, over the centres
 * of the visible voxels. `around` must be 0. */
void trip_outline_reach(const trip_outline *o, const trip_reach_origin *origin,
                        const trip_reach *wanted, int count, double *values);

/* Returns the number of voxels examined. */
uint64_t trip_outline_splats(const trip_outline *o);

#endif
