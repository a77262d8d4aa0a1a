/* Where the voxels of a grid lie along its axes, for grids with uneven spacing. Voxel (i, j, k)
 * then has its centre at the place (x[i], y[j], z[k]), one table an axis, which the grid's
 * index_to_world takes to the world as it takes (i, j, k) where spacing is even. Places are counted
 * in mean spacings: the first is 0, the last the number of voxels less 1, so that the grid fills
 * the same box either way. Rays are straight among places, and values are interpolated linearly in
 * each cell between them. Plain values; the tables are the caller's. */
#ifndef TRIP_COORDINATES_H
#define TRIP_COORDINATES_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "geometry.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Of an axis with one voxel the table is { 0 }. No two voxels are nearer to one another than this:
 */
#define TRIP_COORDINATES_NEAREST 1e-6

typedef struct trip_coordinates {
    const double *along[3]; /* by axis, ascending; all NULL: the spacing is even */
    int64_t voxels[3];
    double widest;  /* the most of trip_coordinates_width() */
    double nearest; /* the least distance of two voxels along an axis */
} trip_coordinates;

static inline bool trip_coordinates_uneven(const trip_coordinates *c)
{
    return c->along[0] != NULL;
}

/* Why `count` numbers are no table; NULL: they are one. */
const char *trip_coordinates_fault(const double *table, int64_t count);

/* Of three tables that are without fault; NULL: even spacing. */
trip_coordinates trip_coordinates_make(const double *const along[3], const int64_t voxels[3]);

/* The place of a position between voxels; beyond the first and last the spacing next to them goes
 * on. */
double trip_coordinates_position(const trip_coordinates *c, int axis, double index);
/* The other way round. */
double trip_coordinates_index(const trip_coordinates *c, int axis, double position);

/* How long a voxel is along an axis: half of what its neighbours are apart, at the ends of the grid
 * what the one neighbour is away. 1 where the spacing is even. */
double trip_coordinates_width(const trip_coordinates *c, int axis, int64_t voxel);

/* Of a voxel, from its integer indices. */
static inline trip_vec3 trip_coordinates_point(const trip_coordinates *c, trip_vec3 voxel)
{
    if (!trip_coordinates_uneven(c))
        return voxel;
    return trip_v3(c->along[0][(int64_t)voxel.x], c->along[1][(int64_t)voxel.y],
                   c->along[2][(int64_t)voxel.z]);
}

/* Of a voxel, along each axis. */
static inline trip_vec3 trip_coordinates_widths(const trip_coordinates *c, trip_vec3 voxel)
{
    return trip_v3(trip_coordinates_width(c, 0, (int64_t)voxel.x),
                   trip_coordinates_width(c, 1, (int64_t)voxel.y),
                   trip_coordinates_width(c, 2, (int64_t)voxel.z));
}

static inline double trip_coordinates_at(const trip_coordinates *c, int axis, int64_t voxel)
{
    return c->along[axis] ? c->along[axis][voxel] : (double)voxel;
}

#ifdef __cplusplus
}
#endif

#endif
