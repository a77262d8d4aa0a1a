/* Finds the default view of an object: from a named side, with the whole object in the picture,
 * centred, with a margin. The caller describes the object by its maximum reach in given directions,
 * so that the fit is exact for any shape. One thread at a time. */
#ifndef TRIP_FRAMING_H
#define TRIP_FRAMING_H

#include "camera.h"

#define TRIP_FRAMING_FILL 0.9 /* share of the picture's width or height that the object fills */

/* A convex function of a position p: along . (p - o) + around * (distance of p from the axis
 * through o). o is the origin. World space and units; around >= 0. */
typedef struct trip_reach {
    trip_vec3 along;
    double around;
} trip_reach;

enum { TRIP_REACHES_MAX = 8 };

/* The origin and axis of reaches. */
typedef struct trip_reach_origin {
    trip_vec3 index; /* o, in index space */
    trip_vec3 axis;  /* world direction, unit length; required if any `around` is not zero */
} trip_reach_origin;

/* The sides of an object. Left and right are the object's own, like a person's who faces the
 * viewer: its left side is on the viewer's right. */
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

/* Parameters of the default view. Zero means the default. */
typedef struct trip_camera_framing {
    double lo[3], hi[3]; /* index-space box around the object */
    /* Sets values[i] to the maximum of wanted[i] over the object, for i < count <=
     * TRIP_REACHES_MAX. Returns 0, or a reported failure. NULL means that the object is the box. */
    int (*reach)(void *user, const trip_reach_origin *origin, const trip_reach *wanted, int count,
                 double *values);
    void *reach_user;
    int width, height;   /* pixels */
    trip_vec3 up, front; /* world directions: up (default +z), and the object's front (default -y,
                            or +z if +y is up) */
    trip_view view;
    /* Relative to the side: azimuth to the viewer's right, elevation upward, roll of the picture
     * clockwise. Degrees. */
    double azimuth_degrees, elevation_degrees, roll_degrees;
    double fov_degrees; /* default 30 */
    bool parallel;
    double ortho_height; /* height of a parallel view; default: fits the whole object */
    bool turntable;      /* fit the object at all angles about up through the centre of the box */
} trip_camera_framing;

/* Tips the object so that another of its directions is up, while its front keeps facing the viewer.
 * If the front becomes parallel to up, the object's former bottom or top faces the viewer. */
void trip_framing_set_up(trip_camera_framing *f, trip_vec3 up);

/* Returns the centre of the box in world space. */
trip_vec3 trip_framing_middle(const trip_camera_framing *f, const trip_affine *index_to_world);

/* Finds the view. The tighter direction has margins of 5 % of the picture on both sides; the other
 * direction is centred. Fails if `reach` fails. */
int trip_camera_frame(const trip_camera_framing *f, const trip_affine *index_to_world,
                      trip_camera_params *out);

#endif
