/* Which list a pixel takes its colour from, and how much: the weights of Hofsetz & Max 2005 section
 * 5.2 and Hofsetz, Max & Bastos 2008 equation 2, by rays in index space. Pure functions. */
#ifndef TRIP_WEIGHT_H
#define TRIP_WEIGHT_H

#include "camera.h"
#include "settings.h"

/* merge:  w_a = max(0, (|r_a| / max |r| - h) / (1 - h))
 * clip:   1 for the largest |r_a| (the first of equals), else 0
 * axis:   1 for `axis_of_view`, else 0
 * At every ray at least one weight is 1. */
double trip_weight(const trip_settings *s, int axis_of_view, trip_vec3 ray, int axis);

/* argmax |r_a| of the ray at the image centre: the one list of Westover's method. */
int trip_weight_axis_of_view(const trip_camera *c);

/* A bound for culling by w +- dw (2008 section 5.4), exact in the safe direction: false only when
 * no ray that passes within `radius` (index space) of `centre` has weight in list `axis`. For a ray
 * through c + e, |e| <= radius: |r_a| - h max |r_b| <= |c_a| - h max |c_b| + sqrt(1 + h^2) radius,
 * c taken from the eye. (clip: h = 1. Parallel views: the weight of the one direction decides.) */
bool trip_weight_may_reach(const trip_settings *s, const trip_camera *c, int axis_of_view, int axis,
                           trip_vec3 centre_from_eye, double radius);

#endif
