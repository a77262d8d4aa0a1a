/* A hyperline: a point with its colours from several cameras (Hofsetz and Max 2005, Figure 8;
 * Hofsetz et al. 2004, "Light Field Rendering Using Colored Point Clouds"). Pure functions.
 *
 * The coefficients of a trip_gaussian hold it. sh[0] is the mean colour of the cameras. A camera
 * has a pair of coefficients: the direction from the point to the camera, times 1/4, and the colour
 * that it sees, less the mean colour. The pairs are at coefficients 1 and 2, 4 and 5, 6 and 7, 9
 * and 10, 11 and 12, 13 and 14. So coefficients up to degree 1 hold 1 camera, up to degree 2 hold
 * 3, and up to degree 3 hold 6. A direction of 0, 0, 0 means no camera.
 *
 * With directions d_i of unit length, and e from the point to the eye, the colour is
 *
 *     mean + sum w_i difference_i / sum w_i,   w_i = max(0, e . d_i)^TRIP_HYPERLINE_POWER
 *
 * It is the mean colour if all w_i are 0. */
#ifndef TRIP_HYPERLINE_H
#define TRIP_HYPERLINE_H

#include <math.h>

#include "gaussian.h"

enum { TRIP_HYPERLINE_CAMERAS = 6 };
#define TRIP_HYPERLINE_POWER 32
#define TRIP_HYPERLINE_LENGTH 0.25

/* Returns the coefficient of a camera's direction. The colour follows it. */
static inline int trip_hyperline_at(int camera)
{
    static const int at[TRIP_HYPERLINE_CAMERAS] = { 1, 4, 6, 9, 11, 13 };
    return at[camera];
}

/* Returns the number of cameras up to a degree. */
static inline int trip_hyperline_cameras(int degree)
{
    return degree >= 3 ? TRIP_HYPERLINE_CAMERAS : degree == 2 ? 3 : degree == 1 ? 1 : 0;
}

/* Adds the colours of the cameras up to a degree to a mean colour. `to_eye` has unit length. */
static inline void trip_hyperline_add(const trip_gaussian *g, int degree, const double to_eye[3],
                                      double rgb[3])
{
    const int cameras = trip_hyperline_cameras(degree);
    double cosine[TRIP_HYPERLINE_CAMERAS], most = 0, all = 0, sum[3] = { 0 };
    for (int i = 0; i < cameras; i++) {
        const float *d = g->sh[trip_hyperline_at(i)];
        const double x = (double)d[0], y = (double)d[1], z = (double)d[2];
        const double length = sqrt(x * x + y * y + z * z);
        cosine[i] = length > 0 ? (x * to_eye[0] + y * to_eye[1] + z * to_eye[2]) / length : 0;
        most = fmax(most, cosine[i]);
    }
    for (int i = 0; i < cameras; i++) {
        if (!(cosine[i] > 0))
            continue;
        double w = cosine[i] / most; /* at most 1, so that a power cannot be too small for all */
        for (int k = 1; k < TRIP_HYPERLINE_POWER; k *= 2)
            w *= w;
        all += w;
        for (int c = 0; c < 3; c++)
            sum[c] += w * (double)g->sh[trip_hyperline_at(i) + 1][c];
    }
    for (int c = 0; c < 3 && all > 0; c++)
        rgb[c] += sum[c] / all;
}

/* Turns the directions to the cameras by a matrix. */
static inline void trip_hyperline_turn(trip_gaussian *g, const double m[3][3])
{
    for (int i = 0; i < TRIP_HYPERLINE_CAMERAS; i++) {
        float *d = g->sh[trip_hyperline_at(i)];
        const double v[3] = { (double)d[0], (double)d[1], (double)d[2] };
        for (int a = 0; a < 3; a++)
            d[a] = (float)(m[a][0] * v[0] + m[a][1] * v[1] + m[a][2] * v[2]);
    }
}

#endif
