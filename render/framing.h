/* Which view shows an object well when none is given: from a named side, everything in the picture,
 * centred, with a margin. What is to be in the picture is given by how far it reaches in given
 * directions, so that the fit is exact for any shape. One thread. */
#ifndef TRIP_FRAMING_H
#define TRIP_FRAMING_H

#include "camera.h"

#define TRIP_FRAMING_FILL 0.9 /* of the picture's width or height; the rest is margin */

/* A convex function of a position p, counted from an origin o: along . (p - o) plus `around` times
 * the distance of p from the axis through o. World space and units; around >= 0. */
typedef struct trip_reach {
    trip_vec3 along;
    double around;
} trip_reach;

enum { TRIP_REACHES_MAX = 8 };

/* Where reaches are taken from. */
typedef struct trip_reach_origin {
    trip_vec3 index; /* o, in index space */
    trip_vec3 axis;  /* world direction, unit length; needed where some `around` is not zero */
} trip_reach_origin;

/* Sides that an object can be seen from. Left and right are its own, as those of a person who faces
 * the viewer: its left side is on the viewer's right. */
typedef enum trip_view {
    TRIP_VIEW_DEFAULT, /* the front, a little from its left and from above */
    TRIP_VIEW_FRONT,
    TRIP_VIEW_BACK,
    TRIP_VIEW_LEFT,
    TRIP_VIEW_RIGHT,
    TRIP_VIEW_TOP,
    TRIP_VIEW_BOTTOM,
    TRIP_VIEW_ISO, /* equally from the front, its left and above */
} trip_view;

/* What is to be framed, and how. Zero means the default. */
typedef struct trip_camera_framing {
    double lo[3], hi[3]; /* a box of index space about what is to be in the picture */
    /* Sets values[i] to the greatest value of wanted[i], i < count <= TRIP_REACHES_MAX, over what
     * is to be in the picture; 0, or a reported failure. NULL: that is the box. */
    int (*reach)(void *user, const trip_reach_origin *origin, const trip_reach *wanted, int count,
                 double *values);
    void *reach_user;
    int width, height;   /* pixels */
    trip_vec3 up, front; /* world directions: up (+z), and the one the object faces (-y; where +y
                            is up, +z) */
    trip_view view;
    /* Relative to that: round the object to the viewer's right, up, and the picture clockwise. */
    double azimuth_degrees, elevation_degrees, roll_degrees;
    double fov_degrees; /* 30 */
    bool parallel;
    double ortho_height; /* of a parallel view; default: that all is in the picture */
    bool turntable; /* the object may turn about up, through the box's middle: all of it stays in
                       the picture */
} trip_camera_framing;

/* Another up: the object is tipped so that this direction of it is up. It goes on facing the viewer
 * with its front, or, where that comes to lie along up, with the side that was at the bottom or at
 * the top. */
void trip_framing_set_up(trip_camera_framing *f, trip_vec3 up);

/* The middle of the box, in world space. */
trip_vec3 trip_framing_middle(const trip_camera_framing *f, const trip_affine *index_to_world);

/* The view. In the direction that is the tighter fit, margins of 5 % of the picture are left on
 * both sides; in the other the object is in the middle. Fails as `reach` does. */
int trip_camera_frame(const trip_camera_framing *f, const trip_affine *index_to_world,
                      trip_camera_params *out);

#endif
