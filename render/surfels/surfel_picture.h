/* The definition of the deferred picture of clouds of points, after Guennebaud, Barthe & Paulin
 * 2004 (Deferred splatting). All renderers follow it. The picture is a function of the view and of
 * the set of surfels. Neither their order nor earlier pictures matter.
 *
 * Scene space and the camera are as in gaussian_picture.h.
 *
 * Surfel (surfel_footprint.h)
 * ---------------------------
 * A surfel is a flat Gaussian. Its radii are TRIP_SURFEL_RADIUS deviations. Its disc is larger by
 * TRIP_SURFEL_WIDEN, since points are not spaced evenly. The axis with the least deviation is its
 * normal. This holds for coarse Gaussians, too. Their deviations are multiplied by
 * TRIP_SURFEL_MERGED, since discs must cover their voxels.
 *
 * Let d = p - (X, Y) be the way from the pixel position of the centre to p, and z the depth of the
 * centre. Let r be the largest radius, and w the width of a pixel at the centre, both in units of
 * depth. With the covariance S and the limited J of gaussian_picture.h:
 *
 *     S2 = J S J^T + TRIP_SURFEL_LOW_PASS I,                            q(p) = d^T S2^-1 d
 *     S3 = TRIP_SURFEL_WIDEN^2 J S J^T + TRIP_SURFEL_DISC_PASS I,       u(p) = d^T S3^-1 d
 *
 * - The disc covers the positions with u <= TRIP_SURFEL_RIM. The filter lets it cover the pixel
 *   centre nearest to (X, Y) in any case.
 * - z(p) is the depth at which the ray through p meets the plane of the disc. It is limited to
 *   [z - e, z + e], and at least 0. Here e is half the extent of the disc in depth. It is at least
 *   the change of the plane's depth over a pixel, up to TRIP_SURFEL_STEEP w: the filter covers so
 *   much.
 * - The weight at p is m (1 - q / TRIP_SURFEL_REACH)^4, which is near m exp(-0.7 q). It ends
 *   smoothly. m is the opacity times sqrt(|J S J^T| / |S2|), so the filter keeps the mass (EWA,
 *   Zwicker et al. 2001). The root counts as at least TRIP_SURFEL_MASS_MIN.
 * - The tolerance is t = TRIP_SURFEL_OFFSET r + w.
 * - The coverage at p is the distance of p from the rim in pixels, to the first order, from 0 to 1.
 *
 * In perspective, a surfel is drawn if z > r; in parallel views, if z > 0. Its centre must lie
 * inside the clip, and the bounds of its ellipse q <= TRIP_SURFEL_REACH must meet the picture.
 *
 * With trip_gaussian_settings.front, a surfel that faces away is not drawn. Let n be its normal and
 * v the direction of the ray through its centre. It faces away if n . v > 0, and if it has a front
 * side (trip_gaussian.two_sided).
 *
 * Passes
 * ------
 * 1. Visibility: D(p) is the least z(p) of all drawn surfels that cover the centre of pixel p. It
 *    is infinite where no surfel does.
 * 2. Selection: each surfel belongs to the cell of its centre. Cells are the pixels, and coarser
 *    cells around the picture (trip_surfel_cell()). Let z' be z(p) at the centre of the cell's
 *    pixel, or z outside the picture. A cell selects the surfel with the least z' - t, at least 0.
 *    Equal surfels are taken in the order of their numbers. The surfel is visible if z' - t is at
 *    most D at the cell's pixel, or at the pixel nearest to the cell.
 * 3. Blending: each visible surfel with |z(p) - D(p)| <= t adds to pixel p its weight, colour,
 *    tolerance, and coverage. The colour C(p) and the tolerance T(p) are the sums over the weights
 *    divided by the sum of the weights. The opacity A(p) is the sum of the coverages, at most 1.
 *    A pixel without weights but with a finite D has the C and T of another pixel: the one with the
 *    least difference of D, in the least square about the pixel that has any, up to
 *    TRIP_SURFEL_DONORS pixels away. Without such a pixel it is empty.
 * 4. Edges: the neighbours with weights or an infinite D, and with D > D(p) + T(p), lie behind p.
 *    The mean of their colours, where an infinite D counts as transparent, comes behind p with the
 *    weight 1 - A(p). If no neighbour lies behind p, p is opaque.
 *
 * An opacity_scale below 1 gives the whole cloud the opacity 1 - 0.01^opacity_scale, since surfels
 * have an opacity of 0.99. The background comes behind all. The depth picture (layer.h) has D(p),
 * and infinity where nothing is drawn.
 *
 * Limits: the sides of a wall thinner than t blend, unless front sides alone are drawn. A plane
 * that is steeper than TRIP_SURFEL_STEEP may have gaps.
 *
 * Surfels behind D + t at all pixels that they may reach change nothing. So renderers may leave out
 * any that are behind the D known so far: no bit of the picture depends on it. */
#ifndef TRIP_SURFEL_PICTURE_H
#define TRIP_SURFEL_PICTURE_H

#include <math.h>

#include "gaussian_picture.h"

#define TRIP_SURFEL_RADIUS                                                                         \
    (1 / 0.85) /* in deviations: a surfel's radius, where its weight halves */
#define TRIP_SURFEL_RIM 1.3862943611198906 /* 2 ln 2 */
#define TRIP_SURFEL_LOW_PASS 0.48          /* px^2 */
#define TRIP_SURFEL_DISC_PASS 0.4          /* px^2; RIM times this is above 1/2 */
#define TRIP_SURFEL_WIDEN 1.5
#define TRIP_SURFEL_REACH 6.0 /* squared deviations */
#define TRIP_SURFEL_MERGED 1.3
#define TRIP_SURFEL_OFFSET 1.0
#define TRIP_SURFEL_STEEP 16.0 /* the tangent of the steepest plane that is followed */
#define TRIP_SURFEL_MASS_MIN 1e-3

enum {
    TRIP_SURFEL_DONORS = 16,
    TRIP_SURFEL_GUARD = 40, /* cells beyond each side of the picture */
    TRIP_SURFEL_FINE = 8,   /* cells as wide as pixels; and cells of an octave further out */
};

/* Returns the opacity of the whole cloud. */
static inline double trip_surfel_opacity(const trip_gaussian_settings *s)
{
    return s->opacity_scale > 0 && s->opacity_scale < 1 ? 1 - pow(0.01, s->opacity_scale) : 1;
}

/* Returns the cell of a position along an axis, from -TRIP_SURFEL_GUARD up to
 * size + TRIP_SURFEL_GUARD - 1. */
static inline int trip_surfel_cell(double at, int size)
{
    const double beyond = at < 0 ? -at : at - size;
    double guard;
    if (at >= 0 && at < size)
        return (int)at;
    guard = beyond < TRIP_SURFEL_FINE
                ? floor(beyond)
                : TRIP_SURFEL_FINE + floor(TRIP_SURFEL_FINE * log2(beyond / TRIP_SURFEL_FINE));
    guard = fmin(guard, TRIP_SURFEL_GUARD - 1);
    return at < 0 ? -1 - (int)guard : size + (int)guard;
}

/* Returns the pixel of a cell, or the pixel nearest to it, along an axis. */
static inline int trip_surfel_pixel(int cell, int size)
{
    return cell < 0 ? 0 : cell < size ? cell : size - 1;
}

#endif
