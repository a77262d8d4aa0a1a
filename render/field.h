/* A volume in memory, for access anywhere: at each voxel of a grid a value and its gradient, or
 * nothing. Filled voxel by voxel, in any order, and read-only once it is finished, for any number
 * of threads. Voxels lie in cubes of 8 x 8 x 8, of which those without voxels take no memory: 16
 * bytes for each voxel of the others.
 *
 * Values are in codes of the data set, 0 to 65535, but need not be whole. Between voxels they are
 * interpolated in cells: cell (i, j, k) is the cube from voxel (i, j, k) to (i + 1, j + 1, k + 1),
 * and is empty unless all its eight corners are there. Linear weighs those; cubic the 4 x 4 x 4
 * voxels around by Catmull and Rom's spline, which goes through the values and has central
 * differences as derivatives; gaussian the same voxels (kernel.h). Beyond the grid its edge
 * repeats, and another voxel that is missing there counts as the corner next to it. The gradient is
 * interpolated alike, from those at the voxels. */
#ifndef TRIP_FIELD_H
#define TRIP_FIELD_H

#include <stdint.h>

#include "budget.h"
#include "coordinates.h"
#include "geometry.h"
#include "settings.h"

enum { TRIP_FIELD_EDGE = 8 };

typedef struct trip_field_voxel {
    float code;        /* not a number: there is no voxel */
    float gradient[3]; /* world space, value units per world unit */
} trip_field_voxel;

/* A cube with some voxels. */
typedef struct trip_field_cube {
    int64_t at[3];  /* of its first voxel */
    float own[2];   /* least and greatest code of its voxels */
    float range[2]; /* of what the cells that start in it are interpolated from */
    trip_field_voxel voxels[TRIP_FIELD_EDGE * TRIP_FIELD_EDGE * TRIP_FIELD_EDGE];
} trip_field_cube;

typedef struct trip_field trip_field;

/* Without voxels. Fails where the grid's directory does not fit the budget. */
int trip_field_create(trip_field **out, const int64_t dims[3], trip_budget *budget);
void trip_field_destroy(trip_field *f);

/* Puts a voxel in the grid; gradient NULL: that of the values, by differences. Fails when the
 * memory given does not suffice. */
int trip_field_put(trip_field *f, const int64_t at[3], double code, const double gradient[3]);

/* What the gradients that were not given are worked out with. */
typedef struct trip_field_map {
    trip_affine index_to_world;
    const trip_coordinates *coordinates; /* NULL: spacing is even */
    double value_per_code;
    bool signless; /* gradients given may point either way: they are turned to where values rise */
} trip_field_map;

/* After the last voxel. Differences are central; where a neighbour is missing, to the other. */
int trip_field_finish(trip_field *f, const trip_field_map *map);

const int64_t *trip_field_dims(const trip_field *f);
/* NULL where there is none. */
const trip_field_voxel *trip_field_at(const trip_field *f, int64_t i, int64_t j, int64_t k);

/* The cubes, in the order in which they were begun. */
size_t trip_field_cubes(const trip_field *f);
const trip_field_cube *trip_field_cube_by_number(const trip_field *f, size_t number);
/* That of a voxel; NULL where it has none. */
const trip_field_cube *trip_field_cube_at(const trip_field *f, const int64_t at[3]);

/* What a cell is interpolated from: `edge` voxels along each axis, i fastest. */
typedef struct trip_field_cell {
    int64_t at[3];
    int edge; /* 2 or 4 */
    const trip_field_voxel *voxels[64];
    double min, max; /* no code in the cell is beyond */
} trip_field_cell;

/* What values interpolated from some in [least, most] can be. */
void trip_field_code_bounds(trip_kernel kernel, double min, double max, double bounds[2]);

/* False where the cell is empty. */
bool trip_field_take_cell(const trip_field *f, trip_kernel kernel, const int64_t at[3],
                          trip_field_cell *out);

#endif
