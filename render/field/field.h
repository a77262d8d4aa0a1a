/* A volume in memory for random access. Each voxel of a grid has a value and a gradient, or is
 * missing. It is filled voxel by voxel in any order. Once finished it is read-only, for any number
 * of threads. Voxels lie in cubes of 8 x 8 x 8. Cubes without voxels take no memory; the others
 * take 16 bytes per voxel.
 *
 * Values are draw codes (draw_codes.h), which may be fractional and lie outside of [0, 65535]. A
 * field can also hold the values themselves, and convert them when a cell is loaded. They are
 * interpolated in cells: cell (i, j, k) is the cube from voxel (i, j, k) to (i + 1, j + 1, k + 1).
 * A cell is empty unless all eight corners are present.
 * - linear weights the eight corners.
 * - cubic weights the 4 x 4 x 4 voxels around the cell with Catmull-Rom splines. The splines pass
 *   through the values and have central differences as derivatives.
 * - gaussian weights the same 64 voxels (kernel.h).
 *
 * Beyond the grid, the values at its edge repeat. Any other missing voxel counts as the nearest
 * corner of the cell. The gradient is interpolated in the same way from the gradients at the
 * voxels. */
#ifndef TRIP_FIELD_H
#define TRIP_FIELD_H

#include <stdint.h>

#include "budget.h"
#include "codes.h"
#include "coordinates.h"
#include "geometry.h"
#include "settings.h"

enum { TRIP_FIELD_EDGE = 8 };

typedef struct trip_field_voxel {
    float code;        /* or value; NaN if the voxel is missing */
    float gradient[3]; /* world space, value units per world unit */
} trip_field_voxel;

/* A cube with some voxels. */
typedef struct trip_field_cube {
    int64_t at[3];  /* index of its first voxel */
    float own[2];   /* minimum and maximum code or value of its voxels */
    float range[2]; /* range of codes or values that its cells are interpolated from */
    trip_field_voxel voxels[TRIP_FIELD_EDGE * TRIP_FIELD_EDGE * TRIP_FIELD_EDGE];
} trip_field_cube;

typedef struct trip_field trip_field;

/* Creates a field without voxels. Fails if the grid's directory exceeds the budget. */
int trip_field_create(trip_field **out, const int64_t dims[3], trip_budget *budget);
void trip_field_destroy(trip_field *f);

/* Adds a voxel. If `gradient` is NULL, trip_field_finish() computes it by differences. Fails if
 * memory is exhausted. */
int trip_field_put(trip_field *f, const int64_t at[3], double code, const double gradient[3]);

/* The conversion of a field's numbers to draw codes: code = (number - origin) * scale. */
typedef struct trip_field_unit {
    double origin, scale; /* 0 and 1 for a field of codes */
} trip_field_unit;

/* Makes the numbers of a field values. `unit` converts them to draw codes. No thread may use the
 * field meanwhile. */
void trip_field_set_unit(trip_field *f, trip_field_unit unit);
trip_field_unit trip_field_get_unit(const trip_field *f);

static inline double trip_field_code(trip_field_unit unit, double number)
{
    return (number - unit.origin) * unit.scale;
}

/* Parameters of computed gradients. */
typedef struct trip_field_map {
    trip_affine index_to_world;
    const trip_coordinates *coordinates; /* NULL for even spacing */
    double value_per_code;               /* 1 for a field of values */
    const trip_codes *stored; /* not NULL: the field has whole stored codes, which may be uneven */
    bool signless; /* given gradients have an arbitrary sign; they are turned towards increasing
                      values */
} trip_field_map;

/* Finishes the field after the last voxel. Gradients are central differences, or one-sided if a
 * neighbour is missing. */
int trip_field_finish(trip_field *f, const trip_field_map *map);

const int64_t *trip_field_dims(const trip_field *f);
/* Returns a voxel, or NULL if it is missing. */
const trip_field_voxel *trip_field_at(const trip_field *f, int64_t i, int64_t j, int64_t k);

/* Returns a cube by number, in the order of creation. */
size_t trip_field_cubes(const trip_field *f);
const trip_field_cube *trip_field_cube_by_number(const trip_field *f, size_t number);
/* Returns the cube of a voxel, or NULL if it has none. */
const trip_field_cube *trip_field_cube_at(const trip_field *f, const int64_t at[3]);

/* The voxels that a cell is interpolated from: `edge` along each axis, i fastest. */
typedef struct trip_field_cell {
    int64_t at[3];
    int edge; /* 2 or 4 */
    const trip_field_voxel *voxels[64];
    trip_field_unit unit;
    double min, max; /* range of draw codes in the cell */
} trip_field_cell;

/* Widens [min, max] to the range of interpolated values. */
void trip_field_code_bounds(trip_kernel kernel, double min, double max, double bounds[2]);

/* Loads a cell. Returns false if it is empty. */
bool trip_field_take_cell(const trip_field *f, trip_kernel kernel, const int64_t at[3],
                          trip_field_cell *out);

#endif
