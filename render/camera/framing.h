/* Finds the view of a picture. The steps go one way, from the settings to the kernels:
 *
 * - settings: takes the options of a view as given: trip_view_settings.
 * - object: reads the box of the data set, and its directions up and front: trip_view_object.
 * - orientation: sets another up if one is given. Lets a single slice face the viewer.
 * - directions: turns right, up and forward of the picture by side, azimuth, elevation and roll.
 * - extent: finds how far the visible voxels reach in given directions: visible.h.
 * - framing: finds the point looked at, and the eye's distance or a parallel view's height.
 * - lens: zooms. The result is a trip_camera_params.
 * - camera: converts it to the data's index space: trip_camera_make() of camera.h.
 *
 * trip_view_find() takes the steps from orientation to lens. One thread at a time. */
#ifndef TRIP_FRAMING_H
#define TRIP_FRAMING_H

#include "camera.h"
#include "dataset_metadata.h"
#include "visible.h"

#define TRIP_FRAMING_FILL 0.9 /* share of the picture's width or height that the object fills */
#define TRIP_VIEW_FOV_MIN_DEGREES 1e-6
#define TRIP_VIEW_FOV_MAX_DEGREES 179.999

/* The sides of an object. Left and right are the object's own, like a person's who faces the
 * viewer: its left side is on the viewer's right. */
typedef enum trip_side {
    TRIP_SIDE_DEFAULT, /* the front, a little from its left and from above */
    TRIP_SIDE_FRONT,
    TRIP_SIDE_BACK,
    TRIP_SIDE_LEFT,
    TRIP_SIDE_RIGHT,
    TRIP_SIDE_TOP,
    TRIP_SIDE_BOTTOM,
    TRIP_SIDE_ISO, /* equally from the front, its left and above */
} trip_side;

/* Zero means the default. */
typedef struct trip_view_settings {
    int width, height;             /* pixels; required */
    const double *eye, *look, *up; /* world space; NULL: found */
    trip_side side;                /* unused if an eye is given */
    /* Relative to the side: azimuth to the viewer's right, elevation upward, roll of the picture
     * clockwise. Degrees. */
    double azimuth_degrees, elevation_degrees, roll_degrees;
    double zoom;         /* factor on the picture size, by another lens */
    double fov_degrees;  /* default 30 */
    double ortho_height; /* > 0: parallel view of this height in world units */
    bool ortho_fit;      /* parallel view that fits the whole object */
    bool turntable;      /* fit the object at all angles about up through the centre of the box */
} trip_view_settings;

typedef struct trip_view_object {
    trip_affine index_to_world;
    double lo[3], hi[3];   /* index-space box of the voxels */
    double kernel_radius;  /* voxels: how far splats reach beyond their voxel */
    trip_vec3 up, front;   /* world directions: up (default +z), and the object's front (default -y,
                              or +z if +y is up) */
    trip_vec3 row, column; /* world directions of a single slice's axes; zero for other grids */
    /* Finds the visible part, which the view then fits. NULL: the view fits the box. */
    trip_visible *visible;
} trip_view_object;

typedef struct trip_found_view {
    trip_camera_params params;
    trip_vec3 axis; /* unit length: up of the object, the axis of an orbit */
} trip_found_view;

/* Describes a data set: the bounds of its kept voxels, which do not depend on the size of tiles,
 * and the orientation by its metadata. */
trip_view_object trip_view_object_of(const trip_dataset *d, const trip_dataset_metadata *text);

/* Finds the view. Without an eye, the tighter direction has margins of 5 % of the picture on both
 * sides, and the other direction is centred. Returns 0, or a reported failure: of reading, or
 * TRIP_USAGE for a zoom beyond the limits of the angle of view. */
int trip_view_find(trip_found_view *out, const trip_view_settings *settings,
                   const trip_view_object *object);

#endif
