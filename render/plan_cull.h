/* Which bricks a frame can leave out: a part of the plan. All tests are exact in the safe
 * direction: a brick is left out only when none of its splats can change a pixel. */
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
    TRIP_CULL_TRANSPARENT, /* no code of its range has extinction */
    TRIP_CULL_OUTSIDE,     /* of the view */
    TRIP_CULL_NO_WEIGHT,   /* no ray near it has weight in the list */
    TRIP_CULL_CLIPPED,     /* cut away */
} trip_cull_reason;

/* The side of a plane in index space: inside where normal . (p - eye) >= offset; unit normal. */
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
    double behind;              /* how deep behind the eye splats may still show */
    const trip_clip *clip;      /* in the list's index space; set once it is made */
    const trip_code_set *shown; /* codes with extinction */
    trip_brick_ranges *about;   /* where what bricks lie next to counts; NULL: they alone do */
} trip_cull;

/* For a list of the data set: `camera` views its index space, `grid` is its place in that of level
 * 0; `about` NULL where voxels are drawn one by one. What it is made from outlives it. */
trip_cull trip_cull_make(const trip_dataset *data, const trip_camera *camera,
                         const trip_list_grid *grid, const trip_settings *settings,
                         int axis_of_view, const trip_code_set *shown, trip_brick_ranges *about);

/* How far on the other side of the eye's sheet a splat of the list, `dims` voxels, may lie that
 * shows at a ray with weight, along the list's axis: its centre above the eye where the ray goes
 * down, or the other way round. An upper bound. */
double trip_cull_reach_over_eye(const trip_cull *cull, int axis, const int64_t dims[3]);

/* Whether splats of voxels in a box of the list's grid may be seen, by the view alone. */
bool trip_cull_may_see(const trip_cull *cull, const double lo[3], const double hi[3]);

/* `slab` is the one that the brick is in. */
trip_cull_reason trip_cull_brick(trip_cull *cull, int axis, const trip_file_brick *brick,
                                 const trip_file_slab *slab);

#endif
