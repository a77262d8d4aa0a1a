/* The weights of the three lists at a pixel, by its ray in index space: Hofsetz & Max 2005, section
 * 5.2, and Hofsetz, Max & Bastos 2008, equation 2. Pure functions. */
#ifndef TRIP_WEIGHT_H
#define TRIP_WEIGHT_H

#include "camera.h"
#include "settings.h"

/* Returns the weight w_a of list a = `axis`:
 *
 *     merge:        max(0, (|r_a| / max |r| - h) / (1 - h))
 *     clip:         1 for the largest |r_a| (the first of equals), else 0
 *     axis, image:  1 for `axis_of_view`, else 0
 *
 * At least one weight of every ray is 1. */
double trip_weight(const trip_settings *s, int axis_of_view, trip_vec3 ray, int axis);

/* Returns (|r_a| / max |r| - h) / (1 - h), for merge. It is negative where the list has no weight.
 */
double trip_weight_signed(const trip_settings *s, trip_vec3 ray, int axis);

/* Returns argmax |r_a| of the ray at the image centre: the one list of Westover's method. */
int trip_weight_axis_of_view(const trip_camera *c);

/* Returns h of a method. clip weighs as merge does with h = 1. */
static inline double trip_weight_h(const trip_settings *s)
{
    return s->method == TRIP_METHOD_CLIP ? 1 : trip_settings_h(s);
}

/* A conservative bound for culling by w +- dw (2008, section 5.4). Returns false only if no ray
 * that passes within `radius` (index space) of the centre c has weight in list `axis`. c is
 * relative to the eye. For a ray through c + e, |e| <= radius:
 *
 *     |r_a| - h max |r_b| <= |c_a| - h max |c_b| + sqrt(1 + h^2) radius
 *
 * clip uses h = 1. In parallel views the weight of the one direction decides. */
bool trip_weight_may_reach(const trip_settings *s, const trip_camera *c, int axis_of_view, int axis,
                           trip_vec3 centre_from_eye, double radius);

/* The test of 2008, section 5.4: returns w + |w - v| > 0. Here w is the weight of the ray through
 * the centre, and v of the ray through a point half a kernel's radius b beside it. `beside` is the
 * camera's right vector, b / 2 long. The test is exact only if the weight changes alike on all
 * sides of the centre. For merge in perspective. */
bool trip_weight_of_two_points(const trip_settings *s, int axis, trip_vec3 centre_from_eye,
                               trip_vec3 beside);

/* The direction of a ray along a list's axis. A ray that goes up meets the sheets in ascending
 * order, a ray that goes down in descending order. */
typedef enum trip_way { TRIP_WAY_ANY, TRIP_WAY_UP, TRIP_WAY_DOWN } trip_way;

/* Returns the direction of a ray along an axis. Rays parallel to the sheets count as going up. */
static inline trip_way trip_ray_goes(trip_vec3 ray, int axis)
{
    return trip_component(ray, axis) >= 0 ? TRIP_WAY_UP : TRIP_WAY_DOWN;
}

/* Bounds over a set of rays, by axis: of the components r_a (lo, hi) and of |r_a| (min, max). */
typedef struct trip_ray_bounds {
    double lo[3], hi[3], min[3], max[3];
} trip_ray_bounds;

/* Returns the bounds of rays with components in [lo, hi]. */
trip_ray_bounds trip_ray_bounds_of(const double lo[3], const double hi[3]);

/* Returns the bounds of the rays at pixel positions in [from, to], x and y. */
trip_ray_bounds trip_ray_bounds_over(const trip_camera *c, const double from[2],
                                     const double to[2]);

/* Returns false only if no ray within the bounds has weight in list `axis`. It treats the
 * components as independent, so it becomes exact as the bounds narrow. */
bool trip_weight_may_lie(const trip_settings *s, int axis_of_view, const trip_ray_bounds *bounds,
                         int axis);

/* Returns false only if no ray within the bounds goes in direction `way` along an axis. */
bool trip_way_may_lie(const trip_ray_bounds *bounds, int axis, trip_way way);

/* Whether list `axis` has weight at a pixel centre with a ray in direction `way`. The result is
 * exact. */
bool trip_weight_is_somewhere(const trip_settings *s, const trip_camera *c, int axis_of_view,
                              int axis, trip_way way);

/* Whether list `axis` has weight at every pixel centre, and all rays go in the same direction along
 * it. Then no pixel needs masking, and one direction draws all. Returns true in views with constant
 * weights, because lists without weight are not drawn. */
bool trip_weight_is_everywhere(const trip_settings *s, const trip_camera *c, int axis_of_view,
                               int axis);

#endif
