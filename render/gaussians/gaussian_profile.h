/* The density of a Gaussian along the ray of each pixel, for the orders that let Gaussians overlap:
 * sheets and the integral. Pure functions.
 *
 * A Gaussian with the opacity alpha at a pixel (gaussian_picture.h) has the optical depth
 * tau = -ln(1 - alpha) there. A Gaussian alone then has the same picture in every order. Along the
 * ray, tau is distributed as a normal density of the depth z. Its mean and deviation are the ones
 * of the Gaussian along the ray. Before, the low-pass filter of the footprint widens the Gaussian
 * parallel to the picture. Without the filter, the mean is the place of the greatest density along
 * the ray, and the deviation is 1 / |diag(1 / s) R^T r(p)|. With the filter, a thin Gaussian that
 * is seen from the side keeps its depth at the pixels beside it.
 *
 * J and S2 are the ones of the exact footprint in gaussian_picture.h: J is not limited. z' is the
 * depth of the centre, and d the distance of the pixel from it.
 *
 *     k = J S forward,   G = d^T S2^-1 k
 *     v = forward^T S forward,   V = v - k^T S2^-1 k
 *     q = d^T S2^-1 d,   h = z' - G
 *
 * The density has this mean and deviation in perspective:
 *
 *     z' h z' / (h^2 + V q),   z' sqrt(V / (h^2 + V q))
 *
 * It has these in parallel views:
 *
 *     z' + G,   sqrt(V)
 *
 * Only a flat Gaussian that faces the eye has the deviation 0. The part of a density behind the eye
 * counts as if it were at the eye. */
#ifndef TRIP_GAUSSIAN_PROFILE_H
#define TRIP_GAUSSIAN_PROFILE_H

#include "gaussian_footprint.h"

/* G = x d.x + y d.y and q = (across (d.x - shear d.y))^2 + (down d.y)^2. In perspective, x, y and
 * the root of V are divided by the centre's depth. */
typedef struct trip_gaussian_profile {
    double across, shear, down;
    double x, y, variance;
    double unit; /* of the numbers above: the centre's depth, or 1 in parallel views */
} trip_gaussian_profile;

static inline trip_gaussian_profile trip_gaussian_profile_of(const trip_camera *c,
                                                             const trip_gaussian *g,
                                                             const trip_gaussian_footprint *f)
{
    const trip_vec3 s = trip_gaussian_deviations(g);
    const double unit = c->ortho ? 1 : f->z, add = TRIP_GAUSSIAN_LOW_PASS;
    trip_vec3 jx, jy;
    trip_gaussian_jacobian(c, TRIP_GAUSSIAN_EXACT, f, &jx, &jy);
    const trip_vec3 a = trip_vec3_times(trip_gaussian_to_axes(g, jx), s);
    const trip_vec3 b = trip_vec3_times(trip_gaussian_to_axes(g, jy), s);
    const trip_vec3 z =
        trip_scale(trip_vec3_times(trip_gaussian_to_axes(g, c->forward), s), 1 / unit);
    const double xx = trip_dot(a, a) + add, yy = trip_dot(b, b) + add, xy = trip_dot(a, b);
    const double kx = trip_dot(a, z), ky = trip_dot(b, z);
    const trip_vec3 ab = trip_cross(a, b), az = trip_cross(a, z), bz = trip_cross(b, z);
    /* The determinants of sums have no cancellation in this form. */
    const double flat = trip_dot(ab, ab) + add * (xx + yy - 2 * add) + add * add;
    const double solid = trip_dot(ab, z) * trip_dot(ab, z) +
                         add * (trip_dot(az, az) + trip_dot(bz, bz)) + add * add * trip_dot(z, z);
    return (trip_gaussian_profile){
        .across = sqrt(yy / flat),
        .shear = xy / yy,
        .down = 1 / sqrt(yy),
        .x = (yy * kx - xy * ky) / flat,
        .y = (xx * ky - xy * kx) / flat,
        .variance = solid / flat,
        .unit = unit,
    };
}

/* The normal density of a Gaussian along a ray. */
typedef struct trip_ray_density {
    double tau;
    double from_centre; /* its mean depth, less the depth of the centre */
    double deviation;   /* of the depth */
} trip_ray_density;

/* Computes the density at d = (dx, dy) from the centre. Returns false if alpha counts as 0. */
static inline bool trip_ray_density_of(const trip_gaussian_footprint *f,
                                       const trip_gaussian_profile *p, bool parallel, double dx,
                                       double dy, trip_ray_density *out)
{
    const double alpha =
        fmin(TRIP_GAUSSIAN_ALPHA_MAX, f->opacity * exp(-0.5 * trip_gaussian_radius2(f, dx, dy)));
    if (alpha < TRIP_GAUSSIAN_ALPHA_MIN)
        return false;
    const double u = p->across * (dx - p->shear * dy), v = p->down * dy, q = u * u + v * v;
    const double g = p->x * dx + p->y * dy, h = parallel ? 1 : 1 - g;
    const double by = parallel ? 1 : fmax(h * h + p->variance * q, 1e-12);
    out->tau = -log1p(-alpha);
    out->from_centre = p->unit * (g * h - (parallel ? 0 : p->variance * q)) / by;
    out->deviation = p->unit * sqrt(p->variance / by);
    return true;
}

#endif
