/* The viewer's camera and its controls: plain values in world space, with the geometry of
 * render/camera/camera.h. A change that would make the view invalid is ignored: the eye at the
 * point looked at, or a number that is not finite. Pure functions. */
#ifndef TRIP_VIEW_NAVIGATION_H
#define TRIP_VIEW_NAVIGATION_H

#include <stdbool.h>

#include "triptych.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_navigation {
    double eye[3], look[3], up[3]; /* up: of the picture; not along the view direction */
    double upright[3];             /* unit length: the axis of orbits */
    double fov_degrees;            /* vertical; kept in parallel views */
    double ortho_height;           /* > 0: parallel, so many world units high */
} trip_navigation;

/* Converts the view of a context. `upright` is the axis of orbits; NULL selects the camera's up. */
trip_navigation trip_navigation_from_camera(const triptych_camera *camera, const double *upright);
/* Returns the view for triptych_set_view(). It points into *n. */
triptych_view trip_navigation_view(const trip_navigation *n, int width, int height);

/* Returns the view as options of `triptych render` that reproduce it bit for bit:
 * "--eye X,Y,Z --look ... --up ... --fov DEGREES --size WxH", with --ortho HEIGHT in place of --fov
 * for a parallel view. The text is for free(); NULL if memory is exhausted. */
char *trip_navigation_options(const trip_navigation *n, int width, int height);

/* The camera's axes, unit length. */
typedef struct trip_navigation_axes {
    double right[3], up[3], forward[3];
} trip_navigation_axes;
trip_navigation_axes trip_navigation_get_axes(const trip_navigation *n);

/* Returns the distance from the eye to the point looked at. */
double trip_navigation_distance(const trip_navigation *n);
/* Returns the world units that a pixel covers at distance `depth` along the view direction. */
double trip_navigation_pixel(const trip_navigation *n, int height, double depth);

/* Projects a point to pixels (centres at + 0.5, y down). Returns its distance along the view
 * direction. In perspective the pixel is valid only if that distance is above 0. */
double trip_navigation_project(const trip_navigation *n, int width, int height,
                               const double point[3], double pixel[2]);
/* Computes the point on a pixel's ray at distance `depth` along the view direction. */
void trip_navigation_point(const trip_navigation *n, int width, int height, const double pixel[2],
                           double depth, double point[3]);

/* Turns the eye around the fixed point looked at: counterclockwise seen from above, like
 * triptych_turn(), and up across the top. If the view is upside down, the azimuth is reversed, so
 * that near parts follow a drag. */
void trip_navigation_orbit(trip_navigation *n, double azimuth_degrees, double elevation_degrees);
/* Moves the camera so that points at distance `depth` move by (dx, dy) pixels, right and down. */
void trip_navigation_pan(trip_navigation *n, double dx_px, double dy_px, int height, double depth);
/* Multiplies the distances from `point` by `factor`. Below 1, the camera approaches the point,
 * which stays at its pixel. In parallel views the height of the view is multiplied. */
void trip_navigation_dolly(trip_navigation *n, double factor, const double point[3]);
/* Moves the eye and the point looked at, in world units. */
void trip_navigation_fly(trip_navigation *n, double forward, double right, double up);
/* Turns the view direction about the fixed eye, to the right and up. */
void trip_navigation_turn(trip_navigation *n, double right_degrees, double up_degrees);
/* Turns the picture clockwise. */
void trip_navigation_roll(trip_navigation *n, double degrees);

/* Sets the vertical field of view, and moves the eye so that the point looked at keeps its size. */
void trip_navigation_set_fov(trip_navigation *n, double degrees);
/* Switches between parallel and perspective. The point looked at keeps its size. */
void trip_navigation_set_parallel(trip_navigation *n, bool parallel);
/* Looks from this direction at the same point and distance, upright. If the direction is along the
 * upright axis, up is world y, or z if y is the upright axis. */
void trip_navigation_look_from(trip_navigation *n, const double direction[3]);
/* Frames a box in the same direction: centred, with `fill` (0 to 1) of the picture's width or
 * height. The point looked at becomes the centre of the box, projected onto the view direction. */
void trip_navigation_fit(trip_navigation *n, const double lo[3], const double hi[3], int width,
                         int height, double fill);

#ifdef __cplusplus
}
#endif

#endif
