/* Decides which bricks a frame can leave out; a part of the plan. Every test is conservative: a
 * brick is left out only if none of its splats can change a pixel. Each trip_cull belongs to one
 * thread. */
#ifndef TRIP_PLAN_CULL_H
#define TRIP_PLAN_CULL_H

#include "brick_ranges.h"
#include "camera.h"
#include "code_set.h"
#include "dataset.h"
#include "list_grid.h"
#include "settings.h"

typedef enum trip_cull_reason {
    TRIP_CULL_KEEP,
    TRIP_CULL_TRANSPARENT, /* no code in its range has extinction */
    TRIP_CULL_OUTSIDE,     /* outside the view */
    TRIP_CULL_NO_WEIGHT,   /* no ray near it has weight in the list */
    TRIP_CULL_CLIPPED,     /* outside the clipping planes */
} trip_cull_reason;

/* A half-space of index space: inside where normal . (p - eye) >= offset. The normal has unit
 * length. */
typedef struct trip_cull_plane {
    trip_vec3 normal;
    double offset;
} trip_cull_plane;

typedef struct trip_cull {
    const trip_camera *camera;
    const trip_settings *settings;
    const trip_list_grid *grid;
    const trip_file_header *header;
    const trip_coordinates *coordinates;
    int axis_of_view;
    trip_cull_plane sides[4];   /* through the outermost pixel centres */
    double radius2, low_pass2;  /* radius of a splat at depth z: sqrt(radius2 + low_pass2 z^2) */
    double behind;              /* depth behind the eye up to which splats may be visible */
    const trip_clip *clip;      /* in the list's index space; the caller sets it afterwards */
    const trip_code_set *shown; /* codes with extinction */
    trip_brick_ranges *about;   /* post: code ranges with neighbouring bricks; NULL for splats */
} trip_cull;

/* Prepares the tests for a list of the data set. `camera` views the list's index space, and
 * `grid` is its position in the grid of level 0. `about` is NULL if voxels are drawn as splats.
 * All arguments must outlive the result. */
trip_cull trip_cull_make(const trip_dataset *data, const trip_camera *camera,
                         const trip_list_grid *grid, const trip_settings *settings,
                         int axis_of_view, const trip_code_set *shown, trip_brick_ranges *about);

/* Returns how far beyond the eye's sheet a splat may lie and still be visible at a ray that
 * points away from it, along the list's axis. Its centre lies above the eye and the ray goes
 * down, or the other way round. `dims` is the list's size in voxels. The result is an upper
 * bound. */
double trip_cull_reach_over_eye(const trip_cull *cull, int axis, const int64_t dims[3]);

/* Whether splats of voxels in a box of the list's grid may be visible, by the view alone. */
bool trip_cull_may_see(const trip_cull *cull, const double lo[3], const double hi[3]);

/* Tests a brick; `slab` is the slab that contains it. */
trip_cull_reason trip_cull_brick(trip_cull *cull, int axis, const trip_file_brick *brick,
                                 const trip_file_slab *slab);

#endif
