/* A cell of a field along a ray: what is interpolated there from the voxels around, as polynomials.
 * Plain values. */
#ifndef TRIP_CELL_H
#define TRIP_CELL_H

#include "field.h"
#include "polynomial.h"
#include "ray.h"

/* From where the ray enters the cell, 0, to where it leaves it, 1. */
typedef struct trip_cell_line {
    double from, length; /* in t of the ray, length > 0 */
    double inverse;      /* of the length */
    trip_polynomial code;
    double all[TRIP_POLYNOMIAL_DEGREE + 1][4]; /* the same, and the gradient's three components */
} trip_cell_line;

/* `coordinates`: of the grid, linear cells alone having uneven ones; NULL: voxels lie at integers.
 */
trip_cell_line trip_cell_along(const trip_field_cell *cell, const trip_coordinates *coordinates,
                               const trip_ray *ray, double from, double to);

/* At t: the code, and the gradient as of trip_field_voxel. */
static inline void trip_cell_line_at(const trip_cell_line *l, double t, double out[4])
{
    double x = (t - l->from) * l->inverse;
    for (int k = 0; k < 4; k++)
        out[k] = l->all[l->code.degree][k];
    for (int i = l->code.degree - 1; i >= 0; i--)
        for (int k = 0; k < 4; k++)
            out[k] = out[k] * x + l->all[i][k];
}

static inline double trip_cell_line_t(const trip_cell_line *l, double x)
{
    return l->from + l->length * x;
}

#endif
