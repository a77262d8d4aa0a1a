/* The view in the data's index space, where kernels are round and sheets are planes for any
 * spacing, rotation or shear. Plain values; a frame does not change them.
 *
 * Lengths are in voxels, so that no number of a projection depends on the unit of world space. If a
 * volume and the camera are scaled by a power of two, the picture has the same bits.
 *
 * Pixel coordinates are in pixels from the picture's top left corner, x to the right, y down. The
 * centre of pixel (i, j) lies at (i + 0.5, j + 0.5). The ray of pixel position p = (x, y) has, in
 * index space,
 *
 *     in perspective       origin eye,                  direction r(p) = r0 + x rx + y ry
 *     in parallel views    origin eye + x rx + y ry,    direction r0
 *
 * The depth z of a point satisfies point = origin + z * direction. A power of two scales the
 * directions so that the direction at the picture's centre has a length in [sqrt(1/2), sqrt(2)). A
 * depth is therefore roughly a distance in voxels. */
#ifndef TRIP_CAMERA_H
#define TRIP_CAMERA_H

#include <stdbool.h>
#include <stdint.h>

#include "geometry.h"

/* Maximum width and height of a picture. */
enum { TRIP_PICTURE_MAX_PX = 65536 };

typedef struct trip_camera_params {
    trip_vec3 eye, look, up; /* world space */
    double fov_degrees;      /* full vertical angle of a perspective view, (0, 180) */
    double ortho_height;     /* > 0: parallel view of this height in world units */
    int width, height;       /* pixels */
} trip_camera_params;

typedef struct trip_camera {
    trip_camera_params params; /* world space, as given */
    int width, height;
    bool ortho;
    trip_vec3 eye, r0, rx, ry; /* index space, see above */
    trip_vec3 forward;         /* index-space covector: depth z = forward . (point - eye) */
    trip_vec3 to_x, to_y;      /* index-space covectors, with c = point - eye: x = to_x . c / z in
                                  perspective, x = to_x . c in parallel views; to_y gives y */
    trip_affine index_to_world;
    double voxel_world;      /* cube root of |det index_to_world|: the length of one voxel */
    trip_vec3 world_forward; /* for lighting; unit length */
} trip_camera;

/* Maximum distance of the eye from the first voxel, in voxels. Double precision has an error of a
 * hundredth of a voxel there. */
#define TRIP_CAMERA_FARTHEST_VOXELS 0x1p46
/* Maximum size of a pixel in voxels (at depth 1 in perspective); the minimum is its inverse. */
#define TRIP_CAMERA_PIXEL_VOXELS 1e15

/* Makes the camera. Fails with TRIP_USAGE for an invalid view: eye equal to look, up along the view
 * direction, or a number that is out of range or not finite. */
int trip_camera_make(trip_camera *c, const trip_camera_params *params,
                     const trip_affine *index_to_world);

/* Returns the view turned about an axis through the point looked at, counterclockwise seen against
 * the axis. */
trip_camera_params trip_camera_turn(const trip_camera_params *view, trip_vec3 axis, double degrees);

/* Returns a direction of the view as a world vector. The components count to the left and to the
 * top of the picture, and to the front: from the object to the eye. */
trip_vec3 trip_camera_direction(const trip_camera *c, double left, double up, double front);

/* Returns the direction of the ray at a pixel position: index space, not normalised. */
static inline trip_vec3 trip_camera_ray(const trip_camera *c, double x, double y)
{
    if (c->ortho)
        return c->r0;
    return trip_add(c->r0, trip_add(trip_scale(c->rx, x), trip_scale(c->ry, y)));
}

/* Returns the length of the ray's direction in world units: the distance from depth 0 to 1. */
static inline double trip_camera_ray_length(const trip_camera *c, double x, double y)
{
    return trip_length(trip_affine_vector(&c->index_to_world, trip_camera_ray(c, x, y)));
}

#endif
