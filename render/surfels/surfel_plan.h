/* The bricks that a deferred picture may read, in the order of reading. They belong to the level of
 * detail and meet the view. The order changes no bit of the picture (surfel_picture.h), but
 * bricks read early may hide later ones.
 *
 * With front sides alone, bricks that face away are left out. The normals of a brick lie in a cone
 * with the axis a and the half angle alpha, and its centres p in a box. Let v = p - eye, or the
 * direction of parallel rays. All surfels face away if a . v > sin(alpha) |v| for all p. The left
 * side minus the right one is a concave function of p. So it suffices to test the corners. */
#ifndef TRIP_SURFEL_PLAN_H
#define TRIP_SURFEL_PLAN_H

#include "camera.h"
#include "clip.h"
#include "key_sort.h"
#include "placed_stream.h"

/* The bricks that were visible in an earlier picture of the same sets, ascending. They are read
 * first, since they probably hide others again. Begin with zeros. */
typedef struct trip_surfel_history {
    uint64_t *bricks; /* from the budget; NULL: none */
    size_t count;
} trip_surfel_history;

void trip_surfel_history_drop(trip_surfel_history *h, trip_budget *budget);

typedef struct trip_surfel_brick {
    uint64_t brick;  /* in the list of its axis */
    uint32_t object; /* index of the placed set */
    uint32_t first;  /* number of its first surfel */
    float share;     /* of the optical depth of its surfels */
    uint8_t axis;
    bool is_coarse;
    bool is_visible; /* holds visible surfels; set by the caller */
} trip_surfel_brick;

typedef struct trip_surfel_plan {
    const trip_placed_set *sets;
    trip_surfel_brick *bricks; /* by ascending numbers */
    trip_key *order;           /* `number` is an index of bricks; in the order of reading */
    size_t count;
    uint64_t records;
    uint64_t away_records;    /* of bricks in view that face away */
    uint64_t coarse_records;  /* of both */
    uint64_t outside_records; /* of bricks that do not meet the view, of sets that do */
    unsigned objects;         /* sets that meet the view */
    void *memory;
    size_t bytes;
} trip_surfel_plan;

typedef struct trip_surfel_plan_params {
    const trip_placed_set *sets;
    unsigned set_count;
    const trip_camera *camera;
    const trip_clip *clip;
    double lod_px;                      /* as in trip_gaussian_lod */
    bool front;                         /* leaves out bricks that face away */
    const trip_surfel_history *history; /* NULL: none */
    trip_budget *budget;
} trip_surfel_plan_params;

/* Fails (reported) if the budget is too small. */
int trip_surfel_plan_make(trip_surfel_plan *plan, const trip_surfel_plan_params *params);
void trip_surfel_plan_drop(trip_surfel_plan *plan, trip_budget *budget);

const trip_file_gaussian_brick *trip_surfel_plan_brick(const trip_surfel_plan *plan,
                                                       const trip_surfel_brick *b);

/* Sets pixel bounds of all that a brick's surfels reach, and a depth that they lie behind together
 * with their tolerances. Returns false if there are no such bounds. */
bool trip_surfel_plan_bounds(const trip_surfel_plan *plan, const trip_camera *c,
                             const trip_surfel_brick *b, double lo[2], double hi[2], double *depth);

/* Keeps the visible bricks of a plan. Keeps none if the budget is too small. */
void trip_surfel_plan_keep_visible(const trip_surfel_plan *plan, trip_surfel_history *h,
                                   trip_budget *budget);

#endif
