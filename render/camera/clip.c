#include "clip.h"

#include <assert.h>
#include <math.h>

void trip_clip_add(trip_clip *clip, trip_vec3 normal, double offset)
{
    assert(clip->count < TRIP_CLIP_MAX);
    clip->planes[clip->count++] = (trip_half_space){ normal, offset };
}

void trip_clip_add_box(trip_clip *clip, const double lo[3], const double hi[3],
                       const trip_affine *to_space)
{
    for (int a = 0; a < 3; a++) {
        const double *row = to_space->m[a];
        const trip_vec3 normal = trip_v3(row[0], row[1], row[2]);
        if (isfinite(lo[a]))
            trip_clip_add(clip, normal, row[3] - lo[a]);
        if (isfinite(hi[a]))
            trip_clip_add(clip, trip_scale(normal, -1), hi[a] - row[3]);
    }
}

trip_clip trip_clip_before(const trip_clip *clip, const trip_affine *to_world)
{
    const trip_vec3 origin = trip_affine_point(to_world, trip_v3(0, 0, 0));
    trip_clip out = { .count = clip->count };
    for (int i = 0; i < clip->count; i++) {
        const trip_half_space *p = &clip->planes[i];
        trip_vec3 normal = trip_affine_transpose_vector(to_world, p->normal);
        double offset = trip_dot(p->normal, origin) + p->offset, length = trip_length(normal);
        double unit = length > 0 ? 1 / length : 1;
        out.planes[i] = (trip_half_space){ trip_scale(normal, unit), offset * unit };
    }
    return out;
}

static uint64_t square_inside(double corner, double along_u, double along_v)
{
    uint64_t mask = 0;
    for (unsigned n = 0; n < 64; n++) {
        unsigned u = (n & 1) | (n >> 1 & 2) | (n >> 2 & 4);
        unsigned v = (n >> 1 & 1) | (n >> 2 & 2) | (n >> 3 & 4);
        mask |= (uint64_t) !(corner + u * along_u + v * along_v < -TRIP_CLIP_SLACK) << n;
    }
    return mask;
}

uint64_t trip_clip_square(const trip_clip *clip, int axis, int64_t sheet, int64_t u, int64_t v)
{
    uint64_t mask = UINT64_MAX;
    for (int i = 0; i < clip->count && mask; i++) {
        const trip_half_space *p = &clip->planes[i];
        const double along_u = trip_component(p->normal, (axis + 1) % 3);
        const double along_v = trip_component(p->normal, (axis + 2) % 3);
        double corner = trip_component(p->normal, axis) * (double)sheet + along_u * (double)u +
                        along_v * (double)v + p->offset;
        double min = corner + 7 * (fmin(0, along_u) + fmin(0, along_v));
        if (min < -TRIP_CLIP_SLACK)
            mask &= square_inside(corner, along_u, along_v);
    }
    return mask;
}

/* Returns whether a voxel lies in the grid and is inside. A square at the edge reaches beyond the
 * grid. */
static bool has_voxel(const trip_clip *clip, const trip_coordinates *coordinates,
                      const int64_t voxel[3])
{
    for (int a = 0; a < 3; a++)
        if (voxel[a] >= coordinates->voxels[a])
            return false;
    return trip_clip_has(clip,
                         trip_v3(coordinates->along[0][voxel[0]], coordinates->along[1][voxel[1]],
                                 coordinates->along[2][voxel[2]]));
}

uint64_t trip_clip_uneven_square(const trip_clip *clip, const trip_coordinates *coordinates,
                                 int axis, const int64_t corner[3])
{
    uint64_t mask = 0;
    for (unsigned n = 0; n < 64; n++) {
        int64_t voxel[3];
        voxel[(axis + 1) % 3] = corner[0] + ((n & 1) | (n >> 1 & 2) | (n >> 2 & 4));
        voxel[(axis + 2) % 3] = corner[1] + ((n >> 1 & 1) | (n >> 2 & 2) | (n >> 3 & 4));
        voxel[axis] = corner[2];
        mask |= (uint64_t)has_voxel(clip, coordinates, voxel) << n;
    }
    return mask;
}

bool trip_clip_ray(const trip_clip *clip, trip_vec3 origin, trip_vec3 direction, double *from,
                   double *to)
{
    for (int i = 0; i < clip->count; i++) {
        const trip_half_space *p = &clip->planes[i];
        double at = trip_dot(p->normal, origin) + p->offset, by = trip_dot(p->normal, direction);
        if (by > 0)
            *from = fmax(*from, -at / by);
        else if (by < 0)
            *to = fmin(*to, -at / by);
        else if (at < 0)
            return false;
    }
    return *from < *to;
}

bool trip_clip_misses(const trip_clip *clip, trip_vec3 at, const double lo[3], const double hi[3],
                      double margin)
{
    for (int i = 0; i < clip->count; i++) {
        const trip_half_space *p = &clip->planes[i];
        double farthest = trip_dot(p->normal, at) + p->offset;
        for (int a = 0; a < 3; a++) {
            double n = trip_component(p->normal, a);
            farthest += n > 0 ? n * (hi[a] + margin) : n * (lo[a] - margin);
        }
        if (farthest < -2 * TRIP_CLIP_SLACK)
            return true;
    }
    return false;
}

void trip_clip_simplify(trip_clip *clip, const uint64_t dims[3])
{
    int kept = 0;
    for (int i = 0; i < clip->count; i++) {
        const trip_half_space p = clip->planes[i];
        double min = p.offset;
        for (int a = 0; a < 3; a++)
            min += fmin(0, trip_component(p.normal, a) * (double)(dims[a] - 1));
        if (min < 0)
            clip->planes[kept++] = p;
    }
    clip->count = kept;
}
