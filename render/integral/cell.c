#include "cell.h"

#include <string.h>

enum { FOUR = 4, MAX = TRIP_POLYNOMIAL_DEGREE + 1 };

/* Code and gradient as polynomials: [power][component]. */
typedef double coefficients[MAX][FOUR];

/* Sets the weights of the `edge` voxels along an axis as polynomials: [voxel][power]. The position
 * in the cell is `start` + `rise` x, from 0 at one corner to 1 at the other. */
static void linear_weights(double start, double rise, double w[][4])
{
    w[0][0] = 1 - start;
    w[0][1] = -rise;
    w[1][0] = start;
    w[1][1] = rise;
}

static void cubic_weights(double start, double rise, double w[][4])
{
    /* Twice the Catmull-Rom spline, by powers of the position. */
    static const double spline[4][4] = {
        { 0, -1, 2, -1 }, { 2, 0, -5, 3 }, { 0, 1, 4, -3 }, { 0, 0, -1, 1 }
    };
    for (int i = 0; i < 4; i++) {
        const double *s = spline[i];
        double r1 = rise, r2 = rise * rise, r3 = r2 * rise;
        w[i][0] = 0.5 * (s[0] + start * (s[1] + start * (s[2] + start * s[3])));
        w[i][1] = 0.5 * r1 * (s[1] + start * (2 * s[2] + start * 3 * s[3]));
        w[i][2] = 0.5 * r2 * (s[2] + start * 3 * s[3]);
        w[i][3] = 0.5 * r3 * s[3];
    }
}

/* Adds the product of `terms` coefficients of p and a weight. */
static inline void add_product(coefficients sum, double (*p)[FOUR], int terms, const double *weight,
                               int weight_terms)
{
    for (int i = 0; i < terms; i++)
        for (int j = 0; j < weight_terms; j++)
            for (int k = 0; k < FOUR; k++)
                sum[i + j][k] += p[i][k] * weight[j];
}

/* Weights voxels along x, the sums along y, and those sums along z. */
static inline void weigh(const trip_field_voxel *const *voxels, trip_field_unit unit, int edge,
                         double w[3][4][4], coefficients out)
{
    memset(out, 0, sizeof(coefficients));
    for (int z = 0; z < edge; z++) {
        coefficients plane = { 0 };
        for (int y = 0; y < edge; y++) {
            coefficients row = { 0 };
            for (int x = 0; x < edge; x++, voxels++) {
                const trip_field_voxel *v = *voxels;
                double at[1][FOUR] = { { trip_field_code(unit, v->code), v->gradient[0],
                                         v->gradient[1], v->gradient[2] } };
                add_product(row, at, 1, w[0][x], edge);
            }
            add_product(plane, row, edge, w[1][y], edge);
        }
        add_product(out, plane, 2 * edge - 1, w[2][z], edge);
    }
}

trip_cell_line trip_cell_along(const trip_field_cell *cell, const trip_coordinates *coordinates,
                               const trip_ray *ray, double from, double to)
{
    trip_cell_line l = { .from = from, .length = to - from, .inverse = 1 / (to - from) };
    double w[3][4][4];
    for (int a = 0; a < 3; a++) {
        double d = trip_component(ray->direction, a), rise = d * l.length;
        double start = trip_component(ray->origin, a) + d * from;
        if (coordinates && trip_coordinates_uneven(coordinates)) {
            const double *corner = coordinates->along[a] + cell->at[a];
            start = (start - corner[0]) / (corner[1] - corner[0]);
            rise /= corner[1] - corner[0];
        } else {
            start -= (double)cell->at[a];
        }
        (cell->edge == 2 ? linear_weights : cubic_weights)(start, rise, w[a]);
    }
    if (cell->edge == 2)
        weigh(cell->voxels, cell->unit, 2, w, l.all);
    else
        weigh(cell->voxels, cell->unit, 4, w, l.all);
    l.code.degree = 3 * (cell->edge - 1);
    for (int i = 0; i <= l.code.degree; i++)
        l.code.c[i] = l.all[i][0];
    return l;
}
