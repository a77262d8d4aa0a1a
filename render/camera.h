/* The view, taken to the data's index space, where kernels are round and sheets are planes whatever
 * the spacing, rotation or shear. Lengths are in voxels there, so that no number of a projection
 * grows or shrinks with the unit of the world: scaled by a power of two together with the camera, a
 * volume gives the same picture bit for bit. Plain values; nothing here changes during a frame.
 *
 * Pixel coordinates: x to the right, y down, in pixels, (0, 0) the image's top left corner, so
 * pixel centres lie at + 0.5. The ray of pixel position p = (x, y) in index space has
 *
 *     in perspective   origin eye,                  direction r(p) = r0 + x rx + y ry
 *     in parallel      origin eye + x rx + y ry,    direction r0
 *
 * The depth z of a point satisfies  point = origin + z * direction;  directions are scaled by a
 * power of two so that the one at the image's centre has a length in [sqrt(1/2), sqrt(2)), and
 * depths are about the distance in voxels. */
#ifndef TRIP_CAMERA_H
#define TRIP_CAMERA_H

#include <stdbool.h>
#include <stdint.h>

#include "geometry.h"

/* Of a picture, along either side. */
enum { TRIP_PICTURE_MAX_PX = 65536 };

typedef struct trip_camera_params {
    trip_vec3 eye, look, up; /* world space */
    double fov_degrees;      /* full vertical angle of a perspective view, (0, 180) */
    double ortho_height;     /* > 0: parallel view of this height in world units */
    int width, height;       /* pixels */
} trip_camera_params;

typedef struct trip_camera {
    trip_camera_params params; /* as given */
    int width, height;
    bool ortho;
    trip_vec3 eye, r0, rx, ry; /* index space, see above */
    trip_vec3 forward;         /* index-space covector: depth z = forward . (point - eye) */
    trip_vec3 to_x, to_y;      /* index-space covectors: perspective x = to_x . c / z with
                                  c = point - eye; parallel x = to_x . c; y alike */
    trip_affine index_to_world;
    double voxel_world;      /* cube root of |det index_to_world|: the length of one voxel */
    trip_vec3 world_forward; /* for lighting; of unit length */
} trip_camera;

/* Farther from the first voxel (in voxels) an eye cannot be: there the numbers of a projection, in
 * double precision, are off by a hundredth of a voxel. */
#define TRIP_CAMERA_FARTHEST_VOXELS 0x1p46
/* A pixel may be as many voxels wide or high (at depth 1 in perspective), or one part of as many.
 */
#define TRIP_CAMERA_PIXEL_VOXELS 1e15

/* Fails (usage) for views that are none: eye equals look, up along the view, angles, sizes or
 * distances out of range, not finite. */
int trip_camera_make(trip_camera *c, const trip_camera_params *params,
                     const trip_affine *index_to_world);

/* The view turned about an axis through the point looked at, counterclockwise as seen from where
 * the axis points to. */
trip_camera_params trip_camera_turn(const trip_camera_params *view, trip_vec3 axis, double degrees);

/* Direction (index space, not normalised) of the ray at a pixel position. */
static inline trip_vec3 trip_camera_ray(const trip_camera *c, double x, double y)
{
    if (c->ortho)
        return c->r0;
    return trip_add(c->r0, trip_add(trip_scale(c->rx, x), trip_scale(c->ry, y)));
}

/* Its length in world units: the distance between depths of 0 and 1 along the ray. */
static inline double trip_camera_ray_length(const trip_camera *c, double x, double y)
{
    return trip_length(trip_affine_vector(&c->index_to_world, trip_camera_ray(c, x, y)));
}

#endif
