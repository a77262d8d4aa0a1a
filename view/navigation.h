/* Where the viewer looks from, and how its controls change that: plain values in world space, with
 * the geometry of render/camera.h. A change whose result would be no view (the eye in the point
 * looked at, numbers without end) leaves everything as it is. Pure functions. */
#ifndef TRIP_VIEW_NAVIGATION_H
#define TRIP_VIEW_NAVIGATION_H

#include <stdbool.h>

#include "triptych.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_navigation {
    double eye[3], look[3], up[3]; /* up: of the picture; not along the gaze */
    double upright[3];             /* unit length: what orbits go about */
    double fov_degrees;            /* vertical; kept in parallel views */
    double ortho_height;           /* > 0: parallel, so many world units high */
} trip_navigation;

/* The view that a context has; `upright` is the direction orbits go about, NULL: the camera's up.
 */
trip_navigation trip_navigation_from_camera(const triptych_camera *camera, const double *upright);
/* For triptych_set_view(); points into *n. */
triptych_view trip_navigation_view(const trip_navigation *n, int width, int height);

/* The camera's axes, unit length. */
typedef struct trip_navigation_axes {
    double right[3], up[3], forward[3];
} trip_navigation_axes;
trip_navigation_axes trip_navigation_get_axes(const trip_navigation *n);

/* From the eye to the point looked at. */
double trip_navigation_distance(const trip_navigation *n);
/* World units a pixel covers at a distance along the gaze. */
double trip_navigation_pixel(const trip_navigation *n, int height, double depth);

/* The pixel position of a point (centres lie at + 0.5, y down); returns its distance along the
 * gaze. In perspective a point is in front where that is above 0, and otherwise has no place. */
double trip_navigation_project(const trip_navigation *n, int width, int height,
                               const double point[3], double pixel[2]);
/* The ray of a pixel position: where it begins (parallel: in the plane of the eye), and its
 * direction of unit length. */
void trip_navigation_ray(const trip_navigation *n, int width, int height, const double pixel[2],
                         double origin[3], double direction[3]);
/* The point of that ray at a distance along the gaze. */
void trip_navigation_point(const trip_navigation *n, int width, int height, const double pixel[2],
                           double depth, double point[3]);

/* The eye goes round the point looked at, which stays where it is: counterclockwise seen from
 * above, as triptych_turn(), and up over the top. Seen upside down, the azimuth is reversed, so
 * that a drag moves what is near in its direction. */
void trip_navigation_orbit(trip_navigation *n, double azimuth_degrees, double elevation_degrees);
/* The point at this distance along the gaze moves by so many pixels, x to the right, y down. */
void trip_navigation_pan(trip_navigation *n, double dx_px, double dy_px, int height, double depth);
/* Distances from `point` are multiplied by `factor`: below 1 the point comes nearer and stays at
 * its pixel. Parallel views become so much lower. */
void trip_navigation_dolly(trip_navigation *n, double factor, const double point[3]);
/* Moves eye and point looked at, by world units. */
void trip_navigation_fly(trip_navigation *n, double forward, double right, double up);
/* Looks elsewhere from where the eye is: to the right, up. */
void trip_navigation_turn(trip_navigation *n, double right_degrees, double up_degrees);
/* The picture turns clockwise. */
void trip_navigation_roll(trip_navigation *n, double degrees);

/* Another angle of view, from a distance at which the point looked at keeps its size. */
void trip_navigation_set_fov(trip_navigation *n, double degrees);
/* Between parallel and perspective; the point looked at keeps its size. */
void trip_navigation_set_parallel(trip_navigation *n, bool parallel);
/* From this direction to the same point at the same distance, upright; along the upright axis with
 * the world's y, or z where that is upright, up. */
void trip_navigation_look_from(trip_navigation *n, const double direction[3]);
/* All of a box in the picture, in the middle, as near as `fill` (0 to 1) of its width or height
 * allows, in the same direction. The point looked at becomes the box's middle, moved onto the gaze.
 */
void trip_navigation_fit(trip_navigation *n, const double lo[3], const double hi[3], int width,
                         int height, double fill);

#ifdef __cplusplus
}
#endif

#endif
