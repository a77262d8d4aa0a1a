/* Rotates spherical harmonics of a Gaussian's colour. Any thread. */
#ifndef TRIP_ROTATE_HARMONICS_H
#define TRIP_ROTATE_HARMONICS_H

#include "gaussian.h"

/* A matrix for each degree from 1 on, of 2 degree + 1 rows. */
typedef struct trip_harmonics_rotation {
    double m[TRIP_SH_DEGREE_MAX][7][7];
} trip_harmonics_rotation;

/* Makes the matrices for a rotation matrix. */
void trip_harmonics_rotation_make(trip_harmonics_rotation *r, const double rotation[3][3]);
/* Rotates the coefficients up to a degree. */
void trip_harmonics_rotate(const trip_harmonics_rotation *r, int degree, float sh[TRIP_SH_MAX][3]);

#endif
