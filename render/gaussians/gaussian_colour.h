/* The colour of a Gaussian from a direction: real spherical harmonics up to degree 3. Pure
 * functions. */
#ifndef TRIP_GAUSSIAN_COLOUR_H
#define TRIP_GAUSSIAN_COLOUR_H

#include <math.h>

#include "gaussian_picture.h"
#include "hyperline.h"

/* Computes the values of the first trip_sh_count(degree) harmonics for a direction of unit length.
 * The signs follow Kerbl et al. 2023. */
static inline void trip_sh_basis(int degree, trip_vec3 d, double basis[TRIP_SH_MAX])
{
    const double x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z;
    basis[0] = 0.28209479177387814; /* sqrt(1 / (4 pi)) */
    if (degree < 1)
        return;
    const double a = 0.4886025119029199; /* sqrt(3 / (4 pi)) */
    basis[1] = -a * y;
    basis[2] = a * z;
    basis[3] = -a * x;
    if (degree < 2)
        return;
    const double b = 1.0925484305920792; /* sqrt(15 / (4 pi)) */
    basis[4] = b * x * y;
    basis[5] = -b * y * z;
    basis[6] = 0.31539156525252005 * (2 * zz - xx - yy); /* sqrt(5 / (16 pi)) */
    basis[7] = -b * x * z;
    basis[8] = 0.5 * b * (xx - yy);
    if (degree < 3)
        return;
    const double c = 0.5900435899266435; /* sqrt(35 / (32 pi)) */
    const double e = 0.4570457994644658; /* sqrt(21 / (32 pi)) */
    const double h = 2.890611442640554;  /* sqrt(105 / (4 pi)) */
    basis[9] = -c * y * (3 * xx - yy);
    basis[10] = h * x * y * z;
    basis[11] = -e * y * (4 * zz - xx - yy);
    basis[12] = 0.3731763325901154 * z * (2 * zz - 3 * xx - 3 * yy); /* sqrt(7 / (16 pi)) */
    basis[13] = -e * x * (4 * zz - xx - yy);
    basis[14] = 0.5 * h * z * (xx - yy);
    basis[15] = -c * x * (xx - 3 * yy);
}

/* Computes the display colour seen along a direction of unit length in scene space, from the eye to
 * the centre. Values lie from 0 to TRIP_GAUSSIAN_COLOUR_MAX. */
static inline void trip_gaussian_colour(const trip_gaussian *g, int degree, trip_vec3 direction,
                                        double rgb[3])
{
    double basis[TRIP_SH_MAX];
    if (g->hyperline) {
        for (int c = 0; c < 3; c++)
            rgb[c] = 0.5 + TRIP_SH_CONSTANT * (double)g->sh[0][c];
        trip_hyperline_add(g, degree, (double[]){ -direction.x, -direction.y, -direction.z }, rgb);
        for (int c = 0; c < 3; c++)
            rgb[c] = fmin(TRIP_GAUSSIAN_COLOUR_MAX, fmax(0, rgb[c]));
        return;
    }
    trip_sh_basis(degree, direction, basis);
    for (int c = 0; c < 3; c++) {
        double sum = 0.5;
        for (int i = 0; i < trip_sh_count(degree); i++)
            sum += basis[i] * (double)g->sh[i][c];
        rgb[c] = fmin(TRIP_GAUSSIAN_COLOUR_MAX, fmax(0, sum));
    }
}

#endif
