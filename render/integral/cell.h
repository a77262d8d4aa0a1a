/* The part of a ray in one cell of a field: code and gradient, interpolated from the voxels around,
 * as polynomials along the ray. Plain values. */
#ifndef TRIP_CELL_H
#define TRIP_CELL_H

#include "field.h"
#include "polynomial.h"
#include "ray.h"

/* The polynomials run from 0 where the ray enters the cell to 1 where it leaves it. */
typedef struct trip_cell_line {
    double from, length; /* in t of the ray, length > 0 */
    double inverse;      /* 1 / length */
    trip_polynomial code;
    /* Code and the three components of the gradient: [power][component]. */
    double all[TRIP_POLYNOMIAL_DEGREE + 1][4];
} trip_cell_line;

/* Computes the polynomials of a cell. `coordinates` belong to the grid; only linear cells may have
 * uneven ones. NULL places the voxels at integers. */
trip_cell_line trip_cell_along(const trip_field_cell *cell, const trip_coordinates *coordinates,
                               const trip_ray *ray, double from, double to);

/* Writes the code and the gradient at t. The gradient has the units of trip_field_voxel. */
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
