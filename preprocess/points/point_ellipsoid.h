/* Samples of range images as ellipsoids (Hofsetz and Max 2005, section 6). Pure functions. The
 * paper leaves the weight to a dissertation; this one is ours.
 *
 * The third axis points to the camera. Its deviation is the uncertainty sigma of the distance
 * (range_shape.h). The other two deviations are half the width of a pixel at the distance. The
 * opacity falls with the uncertainty:
 *
 *     o = 1 / (1 + (sigma / (2 s))^2)
 *
 * s is the harmonic mean of sigma over all samples. So o does not depend on the unit of length, and
 * a few samples of large uncertainty do not change it. */
#ifndef TRIP_POINT_ELLIPSOID_H
#define TRIP_POINT_ELLIPSOID_H

#include <math.h>

#include "gaussian.h"
#include "point.h"
#include "point_tiles.h"

/* Sets direction, width and uncertainty of a row. */
static inline void trip_point_aim(trip_point_row *row, const trip_point *p, const double camera[3])
{
    double to[3], length = 0;
    for (int a = 0; a < 3; a++) {
        to[a] = camera[a] - p->position[a];
        length += to[a] * to[a];
    }
    length = sqrt(length);
    for (int a = 0; a < 3; a++)
        row->normal[a] = length > 0 ? (float)(to[a] / length) : (float)(a == 2);
    row->radius = p->footprint;
    row->uncertainty = p->uncertainty;
}

/* Sets deviations and opacity of a Gaussian that is turned to the camera. `factor` multiplies the
 * width. */
static inline void trip_point_stretch(trip_gaussian *g, const trip_point_row *row, double factor,
                                      double mean)
{
    const double times = mean > 0 ? (double)row->uncertainty / (2 * mean) : 0;
    g->deviations[0] = g->deviations[1] = (float)((double)row->radius * factor);
    g->deviations[2] = row->uncertainty;
    g->opacity = (float)(1 / (1 + times * times));
}

#endif
