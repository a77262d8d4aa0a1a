/* Moves, turns and scales Gaussians. Any thread. */
#ifndef TRIP_GAUSSIAN_TRANSFORM_H
#define TRIP_GAUSSIAN_TRANSFORM_H

#include <stdbool.h>

#include "rotate_harmonics.h"

typedef struct trip_gaussian_transform {
    double m[3][4]; /* maps a centre */
    bool identity;
    bool even;          /* the three axes have one scale */
    double scale;       /* if `even` */
    double rotation[4]; /* w, x, y, z; if `even` */
    bool turned;        /* the rotation is not the identity */
    double turn[3][3];  /* the rotation as a matrix */
    trip_harmonics_rotation harmonics;
} trip_gaussian_transform;

/* Makes the transform of a matrix. Returns false if the matrix is no rotation of axes with
 * positive scales. */
bool trip_gaussian_transform_make(trip_gaussian_transform *t, const double m[3][4]);

/* Transforms a Gaussian. Its rotation gets unit length, unless it is 0. */
void trip_gaussian_transform_apply(const trip_gaussian_transform *t, int degree, trip_gaussian *g);

#endif
