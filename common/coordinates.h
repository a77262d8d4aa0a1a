/* Positions of voxels along the axes of a grid with uneven spacing. Voxel (i, j, k) then has its
 * centre at position (x[i], y[j], z[k]), with one table per axis. The grid's index_to_world maps
 * positions to world space; with even spacing, a position equals the index.
 *
 * Positions are in units of the mean spacing. The first is 0 and the last is the number of voxels
 * minus 1, so the grid fills the same box as with even spacing. Rays are straight lines in
 * positions, and values are interpolated linearly in each cell. Plain values; the caller owns the
 * tables. */
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

/* Minimum distance of two neighbouring voxels. The table of an axis with one voxel is { 0 }. */
#define TRIP_COORDINATES_NEAREST 1e-6

typedef struct trip_coordinates {
    const double *along[3]; /* one table per axis, ascending; all NULL for even spacing */
    int64_t voxels[3];
    double widest;  /* maximum of trip_coordinates_width() */
    double nearest; /* minimum distance of two neighbouring voxels along an axis */
} trip_coordinates;

static inline bool trip_coordinates_uneven(const trip_coordinates *c)
{
    return c->along[0] != NULL;
}

/* Returns why `count` numbers are not a valid table, or NULL if they are. */
const char *trip_coordinates_fault(const double *table, int64_t count);

/* Makes coordinates from three valid tables. NULL selects even spacing. */
trip_coordinates trip_coordinates_make(const double *const along[3], const int64_t voxels[3]);

/* Returns the position of an index between voxels. Beyond the ends, the spacing of the nearest two
 * voxels continues. */
double trip_coordinates_position(const trip_coordinates *c, int axis, double index);
/* Returns the index of a position. */
double trip_coordinates_index(const trip_coordinates *c, int axis, double position);

/* Returns the length of a voxel along an axis: half the distance between its two neighbours. At the
 * ends of the grid, it is the distance to the one neighbour. Returns 1 for even spacing. */
double trip_coordinates_width(const trip_coordinates *c, int axis, int64_t voxel);

/* Returns the position of a voxel, given as integer indices. */
static inline trip_vec3 trip_coordinates_point(const trip_coordinates *c, trip_vec3 voxel)
{
    if (!trip_coordinates_uneven(c))
        return voxel;
    return trip_v3(c->along[0][(int64_t)voxel.x], c->along[1][(int64_t)voxel.y],
                   c->along[2][(int64_t)voxel.z]);
}

/* Returns the length of a voxel along each axis. */
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
