/* Clipping by half-spaces. A point is inside if it lies in all of them, so the remaining part is a
 * box or another convex body. Plain values. Settings hold them in world space, renderers in the
 * index space of their data.
 *
 * - Splats (splat.h): a splat is drawn if its centre is inside. The set of splats does not depend
 *   on the view, and the picture equals one of a volume without the other voxels. Splats reach
 *   beyond the plane by their radius.
 * - Interpolated values (sheet.h, and the integral): each ray is cut at the planes, also between
 *   voxels. The values along the remaining part do not change. */
#ifndef TRIP_CLIP_H
#define TRIP_CLIP_H

#include <stdbool.h>
#include <stdint.h>

#include "coordinates.h"
#include "geometry.h"

/* A box has six planes, the user gives up to six, and two bound a level of detail (lod_parts.h). */
enum { TRIP_CLIP_BOX_PLANES = 6, TRIP_CLIP_GIVEN_PLANES = 6, TRIP_CLIP_MAX = 14 };

/* Distance, in index space, within which a voxel counts as on the plane and so as inside, despite
 * rounding. */
#define TRIP_CLIP_SLACK 0x1p-10

/* Inside: normal . p + offset >= 0. */
typedef struct trip_half_space {
    trip_vec3 normal;
    double offset;
} trip_half_space;

typedef struct trip_clip {
    int count;
    trip_half_space planes[TRIP_CLIP_MAX];
} trip_clip;

/* Adds a half-space. Requires count < TRIP_CLIP_MAX. */
void trip_clip_add(trip_clip *clip, trip_vec3 normal, double offset);
/* Adds the box [lo, hi]; infinite bounds add nothing. The box is in world space, or in the space
 * that `to_space` maps world space to. */
void trip_clip_add_box(trip_clip *clip, const double lo[3], const double hi[3],
                       const trip_affine *to_space);

/* Returns the clip in the source space of a map, with normals of unit length. A plane with a zero
 * normal there keeps everything or nothing. */
trip_clip trip_clip_before(const trip_clip *clip, const trip_affine *to_world);

/* Returns whether a voxel, in index space, is inside. */
static inline bool trip_clip_has(const trip_clip *clip, trip_vec3 voxel)
{
    for (int i = 0; i < clip->count; i++)
        if (trip_dot(clip->planes[i].normal, voxel) + clip->planes[i].offset < -TRIP_CLIP_SLACK)
            return false;
    return true;
}

/* Returns a mask of the voxels inside, for the 8 x 8 square of a sheet with its corner at u, v.
 * Bits are in Morton order, as in a block. */
uint64_t trip_clip_square(const trip_clip *clip, int axis, int64_t sheet, int64_t u, int64_t v);
/* Returns the mask of a square for uneven spacing. `corner` is u, v and sheet. */
uint64_t trip_clip_uneven_square(const trip_clip *clip, const trip_coordinates *coordinates,
                                 int axis, const int64_t corner[3]);

/* Narrows [*from, *to] to the t with origin + t direction inside. Returns false if none is left. */
bool trip_clip_ray(const trip_clip *clip, trip_vec3 origin, trip_vec3 direction, double *from,
                   double *to);

/* Returns whether a box at `at`, grown by `margin` along each axis, is entirely outside. */
bool trip_clip_misses(const trip_clip *clip, trip_vec3 at, const double lo[3], const double hi[3],
                      double margin);

/* Removes half-spaces that contain the whole of [0, dims - 1]. */
void trip_clip_simplify(trip_clip *clip, const uint64_t dims[3]);

#endif
