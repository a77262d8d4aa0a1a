/* Finds how far the visible voxels reach in given directions: the exact maxima of convex functions
 * over them, independent of the tiles. It skips bricks and sheets that cannot reach farther than
 * the result so far, and mostly reads a small part of one list. One thread.
 *
 * Two definitions of visible:
 * - Visible together with others: a ray through equal voxels along a sixteenth of the data set's
 *   diagonal loses at least 1/255 of its light. Fainter voxels are visible only where many lie
 *   behind one another, and they do not at the rim.
 * - Visible alone: a ray through the voxel loses a tenth of its light.
 *
 * With an outline, the visible part is the outline and the voxels that are visible alone. Otherwise
 * it is the voxels that are visible together with others. */
#ifndef TRIP_VISIBLE_H
#define TRIP_VISIBLE_H

#include "code_set.h"
#include "outline.h"

enum { TRIP_VISIBLE_POSITIONS = 32 };

/* Position and code of a voxel. */
typedef struct trip_visible_position {
    double u, v, sheet;
    unsigned code;
} trip_visible_position;

typedef struct trip_visible {
    /* Set by the caller; must outlive the struct. */
    const trip_dataset *data;
    trip_reader *reader; /* reads voxels, no pass running; may skip by trip_visible_skip() */
    trip_budget *budget;
    const trip_tf_entry *table; /* filled for the data set */

    double lo[3], hi[3];  /* bounds of all voxels in index space */
    double kernel_radius; /* voxels: how far splats reach beyond their voxel; may be set any time */
    trip_outline *outline; /* NULL: voxels visible together with others count */
    uint64_t splats;       /* examined so far */
    trip_code_set codes;   /* codes of the visible voxels */
    /* Results of the last searches. Later searches start from them. */
    trip_visible_position positions[TRIP_VISIBLE_POSITIONS];
    unsigned position_count;                  /* all results so far */
    const struct trip_visible_search *search; /* current search, or NULL */
} trip_visible;

/* Starts, after the caller's fields are set; the others must be zero. [lo, hi] are the bounds of
 * all voxels. */
void trip_visible_start(trip_visible *v, const double lo[3], const double hi[3]);
void trip_visible_end(trip_visible *v);

/* Implements trip_reader_params.skip; `user` is the trip_visible. Skips runs that reach no farther
 * than the result so far. */
bool trip_visible_skip(void *user, const trip_selection *selection, const trip_run *run);

/* Computes the bounds of the visible voxels in index space, without kernels. */
int trip_visible_bounds(trip_visible *v, double lo[3], double hi[3]);

/* Makes the outline. There is none if nothing is visible in it, or if no level is small enough. */
int trip_visible_outline(trip_visible *v);

/* Sets values[i] to the maximum of wanted[i] over the visible part with its kernels, for i < count
 * <= TRIP_REACHES_MAX. With an outline, `around` must be 0. If no voxel is visible together with
 * others, it uses the bounds of all voxels. */
int trip_visible_reach(trip_visible *v, const trip_reach_origin *origin, const trip_reach *wanted,
                       int count, double *values);

#endif
