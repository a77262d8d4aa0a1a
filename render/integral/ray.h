/* A ray of the picture in index space, and the boxes of a grid that it passes through. Plain
 * values. */
#ifndef TRIP_RAY_H
#define TRIP_RAY_H

#include "camera.h"
#include "coordinates.h"

/* The points origin + t direction, 0 <= t <= end. */
typedef struct trip_ray {
    trip_vec3 origin, direction;
    double end;
    trip_vec3 inverse;  /* of the direction's components; NaN for 0 */
    double world_per_t; /* length of `direction` in world units */
} trip_ray;

/* Returns the ray of a pixel position, without end. */
trip_ray trip_ray_make(const trip_camera *c, double x, double y);
/* Returns a ray from a point in a direction, in index space. world_per_t is the length of
 * `direction` in world units. */
trip_ray trip_ray_from(trip_vec3 origin, trip_vec3 direction, double world_per_t, double end);

static inline trip_vec3 trip_ray_at(const trip_ray *r, double t)
{
    return trip_add(r->origin, trip_scale(r->direction, t));
}

/* A box [lo, hi) of voxels, divided into cubes of `edge` from lo on. The last cubes may be shorter.
 * trip_ray_walk() visits the cubes that the ray passes with t in [from, to], from the eye on. `at`
 * is the first corner of a cube. The walk stops and returns false if a visit returns false. */
typedef struct trip_ray_boxes {
    int64_t lo[3], hi[3], edge;
    const trip_coordinates *coordinates; /* positions of the faces; NULL places them at integers */
} trip_ray_boxes;
typedef bool (*trip_ray_visit)(void *user, const int64_t at[3], double from, double to);
bool trip_ray_walk(const trip_ray *r, const trip_ray_boxes *boxes, double from, double to,
                   trip_ray_visit visit, void *user);

/* Limits [*from, *to] to the whole box [lo, hi]. Returns false if nothing is left. */
bool trip_ray_clip(const trip_ray *r, const trip_ray_boxes *boxes, double *from, double *to);

#endif
