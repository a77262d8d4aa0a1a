/* A ray of the picture in index space, and the boxes of a grid that it passes. Plain values. */
#ifndef TRIP_RAY_H
#define TRIP_RAY_H

#include "camera.h"
#include "coordinates.h"

/* The points origin + t direction, 0 <= t <= end. */
typedef struct trip_ray {
    trip_vec3 origin, direction;
    double end;
    trip_vec3 inverse;  /* of the direction's components; of 0: not a number */
    double world_per_t; /* length of `direction` in the world */
} trip_ray;

/* Of a pixel position, without end. */
trip_ray trip_ray_make(const trip_camera *c, double x, double y);
/* From a place in a direction, index space; world_per_t is the direction's length in the world. */
trip_ray trip_ray_from(trip_vec3 origin, trip_vec3 direction, double world_per_t, double end);

static inline trip_vec3 trip_ray_at(const trip_ray *r, double t)
{
    return trip_add(r->origin, trip_scale(r->direction, t));
}

/* The box [lo, hi) of voxels is divided into cubes of `edge`, from lo on, the last ones short:
 * visits those that the ray passes with t in [from, to], from the eye on, `at` their first corner,
 * until false is returned; then false is returned here. */
typedef struct trip_ray_boxes {
    int64_t lo[3], hi[3], edge;
    const trip_coordinates *coordinates; /* where their faces lie; NULL: at integers */
} trip_ray_boxes;
typedef bool (*trip_ray_visit)(void *user, const int64_t at[3], double from, double to);
bool trip_ray_walk(const trip_ray *r, const trip_ray_boxes *boxes, double from, double to,
                   trip_ray_visit visit, void *user);

/* Cuts [*from, *to] to the box [lo, hi] of all; false where nothing is left. */
bool trip_ray_clip(const trip_ray *r, const trip_ray_boxes *boxes, double *from, double *to);

#endif
