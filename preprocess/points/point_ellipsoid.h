/* Samples of range images, and points of scans, as ellipsoids (Hofsetz and Max 2005, section 6).
 * Pure functions. The paper leaves the weight to a dissertation; this one is ours.
 *
 * The third axis points to the camera. Its deviation is the uncertainty sigma of the distance
 * (range_shape.h). The other two deviations are half the width of a pixel at the distance. The
 * opacity falls with the uncertainty:
 *
 *     o = 1 / (1 + (sigma / (2 s))^2)
 *
 * s is the harmonic mean of sigma over all samples. So o does not depend on the unit of length, and
 * a few samples of large uncertainty do not change it.
 *
 * A point of a scan has neighbours in space (surfel_shape.h) in place of a depth image. Let theta
 * be the angle between its normal and the ray to the scanner, at most TRIP_RANGE_GRAZING. Let s be
 * the distance of points on the surface, and r the roughness. The scanner has samples at the
 * distance 2 h across the ray. Within a sample of a tilted surface, the distance varies by
 * h tan(theta):
 *
 *     sigma^2 = h^2 (1/16 + tan^2 theta) + (r / cos theta)^2
 *
 * 1/16 keeps points of a smooth surface from being certain. At the distance z from the scanner,
 * h = z t / 2, with the tangent t between neighbouring rays (scan_steps.h). Without a range grid,
 * h = sqrt(cos theta) s / 2. That is too small where scans overlap. These formulas are ours, too. */
#ifndef TRIP_POINT_ELLIPSOID_H
#define TRIP_POINT_ELLIPSOID_H

#include <math.h>
#include <string.h>

#include "gaussian.h"
#include "point.h"
#include "point_tiles.h"
#include "range_shape.h"
#include "surfel_shape.h"

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

/* Sets direction, width and uncertainty of a row from its neighbours. `step` is the tangent between
 * rays, or 0. The radius of a point without it is at most `radius_max`. */
static inline void trip_point_estimate(trip_point_row *row, const trip_surfel_shape *shape,
                                       const double camera[3], double step, double radius_max)
{
    trip_point p = { .footprint = 0 };
    memcpy(p.position, row->position, sizeof p.position);
    trip_point_aim(row, &p, camera);
    double cosine = 0, away2 = 0;
    for (int a = 0; a < 3; a++) {
        cosine += (double)row->normal[a] * shape->normal[a];
        away2 += (camera[a] - p.position[a]) * (camera[a] - p.position[a]);
    }
    cosine = fmin(1, fmax(cosine, cos(TRIP_RANGE_GRAZING)));
    const double distance = sqrt(2) * fmin(shape->radius, radius_max);
    const double half = step > 0 ? step * sqrt(away2) / 2 : sqrt(cosine) * distance / 2;
    const double slope2 = 1 / (cosine * cosine) - 1;
    const double rough = shape->roughness / cosine;
    row->radius = (float)half;
    row->uncertainty = (float)sqrt(half * half * (1.0 / 16 + slope2) + rough * rough);
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
