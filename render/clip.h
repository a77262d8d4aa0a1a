/* What is cut away of the volume: all that lies outside of some half-spaces, whose planes cut a box
 * or anything convex. Plain values; settings have them in world space, renderers in the index space
 * of what they draw.
 *
 * Of splats (splat.h) those are drawn whose centre is inside: which voxels these are does not
 * depend on the view, and a clipped volume is drawn as one is that has no others. Where values are
 * interpolated (sheet.h, and by the integral) the ray is cut: what counts is the part of it that is
 * inside, through the same values as before. So a cut there lies where the plane lies, between
 * voxels too, and shows the values themselves; splats reach over it by their radius. */
#ifndef TRIP_CLIP_H
#define TRIP_CLIP_H

#include <stdbool.h>
#include <stdint.h>

#include "coordinates.h"
#include "geometry.h"

/* Six of a box, six more, and two between which a level of detail is drawn (lod_parts.h). */
enum { TRIP_CLIP_BOX_PLANES = 6, TRIP_CLIP_GIVEN_PLANES = 6, TRIP_CLIP_MAX = 14 };

/* Voxels so near to a plane are inside: on it, whatever rounding makes of the distance. In indices.
 */
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

/* There is room for it. */
void trip_clip_add(trip_clip *clip, trip_vec3 normal, double offset);
/* The inside of [lo, hi], infinities being no bounds: of the world, or of the space that `to_space`
 * takes the world to. */
void trip_clip_add_box(trip_clip *clip, const double lo[3], const double hi[3],
                       const trip_affine *to_space);

/* The same in the source space of a map, with normals of unit length; those that would have none
 * keep all or nothing. */
trip_clip trip_clip_before(const trip_clip *clip, const trip_affine *to_world);

/* Whether a voxel is drawn; index space. */
static inline bool trip_clip_has(const trip_clip *clip, trip_vec3 voxel)
{
    for (int i = 0; i < clip->count; i++)
        if (trip_dot(clip->planes[i].normal, voxel) + clip->planes[i].offset < -TRIP_CLIP_SLACK)
            return false;
    return true;
}

/* Of the 8 x 8 square of a list's sheet with its corner at u and v, which voxels are: a bit each by
 * Morton number, as in a block. */
uint64_t trip_clip_square(const trip_clip *clip, int axis, int64_t sheet, int64_t u, int64_t v);
/* The same with uneven spacing; `corner`: u, v and sheet. */
uint64_t trip_clip_uneven_square(const trip_clip *clip, const trip_coordinates *coordinates,
                                 int axis, const int64_t corner[3]);

/* Narrows [*from, *to] to where origin + t direction is inside; false where nothing is left. */
bool trip_clip_ray(const trip_clip *clip, trip_vec3 origin, trip_vec3 direction, double *from,
                   double *to);

/* Whether no point of a box, which is at `at` and grown by `margin` along each axis, is inside. */
bool trip_clip_misses(const trip_clip *clip, trip_vec3 at, const double lo[3], const double hi[3],
                      double margin);

/* Half-spaces that hold all of [0, dims - 1] are left out. */
void trip_clip_simplify(trip_clip *clip, const uint64_t dims[3]);

#endif
