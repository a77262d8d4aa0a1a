/* The area and the optical depth of a Gaussian, averaged over all directions of view. Pure
 * functions. gaussian_moments.h derives them. */
#ifndef TRIP_GAUSSIAN_AREA_H
#define TRIP_GAUSSIAN_AREA_H

#include "gaussian.h"

/* Returns the surface of the ellipsoid of one deviation, divided by 4 pi. */
double trip_gaussian_mean_area(const double deviations[3]);
/* Returns Li2(x) = sum x^k / k^2 for x from 0 to 1. */
double trip_dilogarithm(double x);
/* Returns the integral of the optical depth over the picture, in squared units of the scene. */
double trip_gaussian_mean_depth(const trip_gaussian *g);

#endif
