/* How far the voxels that a transfer function shows reach in given directions: the greatest values
 * of convex functions over all of them, exactly, whatever the tiles. Bricks that cannot reach
 * farther than what was found are not read, nor sheets of them: mostly a small part of one list is.
 * One thread.
 *
 * A voxel counts as visible together with others when a ray that met its like along a sixteenth of
 * the data set's diagonal would lose at least 1/255 of its light: fainter ones are seen where many
 * lie behind one another only, which they do not at the rim. It is visible alone when a ray through
 * it loses a tenth. */
#ifndef TRIP_VISIBLE_H
#define TRIP_VISIBLE_H

#include "code_set.h"
#include "framing.h"
#include "reader.h"
#include "transfer_function.h"

enum { TRIP_VISIBLE_POSITIONS = 32 };

/* Of a voxel. */
typedef struct trip_visible_position {
    double u, v, sheet;
    unsigned code;
} trip_visible_position;

typedef struct trip_visible {
    /* Set by the caller, and outliving this. */
    const trip_dataset *data;
    trip_reader *reader; /* of voxels, no pass under way; it may skip by trip_visible_skip() */
    trip_budget *budget;
    double kernel_radius; /* voxels: how far beyond their voxel splats count as reaching */
    double lo[3], hi[3];  /* bounds of all splats in index space */

    bool alone;          /* which of them count: trip_visible_start() */
    uint64_t splats;     /* looked at so far */
    trip_code_set codes; /* whose voxels are visible */
    /* Where earlier searches ended, the last ones: later ones begin with what reaches far there. */
    trip_visible_position positions[TRIP_VISIBLE_POSITIONS];
    unsigned position_count;                  /* so far */
    const struct trip_visible_search *search; /* under way; NULL: none */
} trip_visible;

/* After the caller's part is set. `table` as filled for the data set. Those visible alone count, or
 * all that are visible together with others. */
void trip_visible_start(trip_visible *v, const trip_tf_entry *table, bool alone);

/* For trip_reader_params.skip, `user` being the trip_visible: what reaches no farther than what was
 * found is left out. */
bool trip_visible_skip(void *user, const trip_selection *selection, const trip_run *run);

/* Bounds of the visible voxels in index space, without kernels. */
int trip_visible_bounds(trip_visible *v, double lo[3], double hi[3]);

/* For trip_camera_framing, `user` being the trip_visible. Where nothing is visible, the bounds of
 * all splats take its place; where nothing is alone, values are -INFINITY. */
int trip_visible_reach(void *user, const trip_reach_origin *origin, const trip_reach *wanted,
                       int count, double *values);

/* Raises values to those of trip_visible_reach() where these are greater, of voxels that are
 * visible alone: what reaches no farther is not looked for. */
int trip_visible_raise(trip_visible *v, const trip_reach_origin *origin, const trip_reach *wanted,
                       int count, double *values);

#endif
