/* Which list a pixel takes its colour from, and how much: the weights of Hofsetz & Max 2005 section
 * 5.2 and Hofsetz, Max & Bastos 2008 equation 2, by rays in index space. Pure functions. */
#ifndef TRIP_WEIGHT_H
#define TRIP_WEIGHT_H

#include "camera.h"
#include "settings.h"

/* merge:  w_a = max(0, (|r_a| / max |r| - h) / (1 - h))
 * clip:   1 for the largest |r_a| (the first of equals), else 0
 * axis, image:  1 for `axis_of_view`, else 0
 * At every ray at least one weight is 1. */
double trip_weight(const trip_settings *s, int axis_of_view, trip_vec3 ray, int axis);

/* merge: (|r_a| / max |r| - h) / (1 - h), which is below 0 where the list has no weight. */
double trip_weight_signed(const trip_settings *s, trip_vec3 ray, int axis);

/* argmax |r_a| of the ray at the image centre: the one list of Westover's method. */
int trip_weight_axis_of_view(const trip_camera *c);

/* The h of a method: clip weighs as merge does with h = 1. */
static inline double trip_weight_h(const trip_settings *s)
{
    return s->method == TRIP_METHOD_CLIP ? 1 : trip_settings_h(s);
}

/* A bound for culling by w +- dw (2008 section 5.4), exact in the safe direction: false only when
 * no ray that passes within `radius` (index space) of `centre` has weight in list `axis`. For a ray
 * through c + e, |e| <= radius: |r_a| - h max |r_b| <= |c_a| - h max |c_b| + sqrt(1 + h^2) radius,
 * c taken from the eye. (clip: h = 1. Parallel views: the weight of the one direction decides.) */
bool trip_weight_may_reach(const trip_settings *s, const trip_camera *c, int axis_of_view, int axis,
                           trip_vec3 centre_from_eye, double radius);

/* The ways that rays go along a list's axis. A ray up it meets the list's sheets in ascending
 * order, one down it in descending order. */
typedef enum trip_way { TRIP_WAY_ANY, TRIP_WAY_UP, TRIP_WAY_DOWN } trip_way;

/* The way of a ray along an axis; those along its sheets count as going up. */
static inline trip_way trip_ray_goes(trip_vec3 ray, int axis)
{
    return trip_component(ray, axis) >= 0 ? TRIP_WAY_UP : TRIP_WAY_DOWN;
}

/* Bounds of the components r_a over a set of rays, by axis, and of |r_a|. */
typedef struct trip_ray_bounds {
    double lo[3], hi[3], min[3], max[3];
} trip_ray_bounds;

/* Of the rays whose components lie in [lo, hi]. */
trip_ray_bounds trip_ray_bounds_of(const double lo[3], const double hi[3]);

/* Of the rays of the pixel positions in [from, to], x and y. */
trip_ray_bounds trip_ray_bounds_over(const trip_camera *c, const double from[2],
                                     const double to[2]);

/* False only when no ray within the bounds has weight in list `axis`. The components are taken
 * apart, which becomes exact as the bounds narrow. */
bool trip_weight_may_lie(const trip_settings *s, int axis_of_view, const trip_ray_bounds *bounds,
                         int axis);

/* False only when no ray within the bounds goes that way along an axis. */
bool trip_way_may_lie(const trip_ray_bounds *bounds, int axis, trip_way way);

/* Whether list `axis` has weight at the centre of some pixel of the image whose ray goes that way,
 * exactly. */
bool trip_weight_is_somewhere(const trip_settings *s, const trip_camera *c, int axis_of_view,
                              int axis, trip_way way);

/* Whether every pixel centre has weight in list `axis`, and its rays go the same way along it: then
 * nothing need be masked, and one direction draws all. In views whose weights are constant it is
 * true: lists without weight are not drawn. */
bool trip_weight_is_everywhere(const trip_settings *s, const trip_camera *c, int axis_of_view,
                               int axis);

#endif
