/* Merging of Gaussians: one Gaussian stands for many. Pure functions.
 *
 * Weight. A Gaussian alone before a white wall blocks the light of an area. Let a be the square
 * root of the determinant of its covariance in the picture, averaged over all directions of view.
 * An opacity o covers 2 pi a o. Drawing leaves out all below c = 1/255, so the covered area is:
 *
 *     m = 2 pi a (o - c)
 *
 * a is the surface of the ellipsoid of one deviation, divided by 4 pi (Cauchy's formula).
 *
 * Moments. Mean centre, covariance and coefficients of the colour are means weighted by m. The
 * covariance is the mean covariance plus the covariance of the centres. Moments of moments are the
 * moments of all.
 *
 * Side. The normal of a merged surfel is its axis with the least deviation, on the side of the mean
 * normal. Means are weighted by m. If the mean cosine between normals and axis is below
 * TRIP_MERGED_SIDE, the surfels have several sides, as in a thin wall. The merged surfel
 * then has no front side: it has two sides.
 *
 * Opacity. Optical depths add up where Gaussians overlap. The integral of the optical depth over
 * the picture is:
 *
 *     t = 2 pi a (Li2(o) - c),   with Li2(o) = sum o^k / k^2
 *
 * Let A be the value of a of the merged covariance. Its mean optical depth is d = sum t / (4 pi A),
 * since an even disc with this covariance has the area 4 pi A. The merged Gaussian keeps sum t, as
 * far as d is at most TRIP_MERGED_DEPTH_MAX: nothing shows through a disc of that depth. Thin
 * Gaussians so keep the area that they cover, and those behind one another cover no more than their
 * disc. If no opacity up to 0.99 gives sum t, the covariance grows until 0.99 does. */
#ifndef TRIP_GAUSSIAN_MOMENTS_H
#define TRIP_GAUSSIAN_MOMENTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gaussian.h"

#define TRIP_MERGED_DEPTH_MAX 1.5
#define TRIP_MERGED_SIDE 0.5

typedef struct trip_gaussian_moments {
    uint64_t count;
    double mass, optical;           /* sums of m and t */
    double centre[3];               /* mean */
    double spread[6];               /* sum of m times covariance: xx, xy, xz, yy, yz, zz */
    double normal[3];               /* sum of m times the normals of surfels */
    double colours[TRIP_SH_MAX][3]; /* sums of m times coefficient */
} trip_gaussian_moments;

/* Returns the bytes of moments that have coefficients up to a degree. All functions leave the bytes
 * behind them alone. */
static inline size_t trip_gaussian_moments_bytes(int degree)
{
    return offsetof(trip_gaussian_moments, colours) +
           (size_t)trip_sh_count(degree) * 3 * sizeof(double);
}

/* Returns whether the moments of a Gaussian have a mass above 0. */
bool trip_gaussian_has_mass(const trip_gaussian *g);
/* Sets the moments of one Gaussian. Its mass is 0 if drawing leaves it out at any size, or if it
 * has no area from any direction. */
void trip_gaussian_moments_of(const trip_gaussian *g, int degree, trip_gaussian_moments *out);
/* Adds moments with a mass above 0. */
void trip_gaussian_moments_add(trip_gaussian_moments *to, const trip_gaussian_moments *from,
                               int degree);
/* Returns the Gaussian that stands for all. */
trip_gaussian trip_gaussian_moments_merge(const trip_gaussian_moments *m, int degree);

#endif
