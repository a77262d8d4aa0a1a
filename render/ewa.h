/* The covariance algebra of EWA volume splatting (Zwicker, Pfister, van Baar and Gross 2001, "EWA
 * volume splatting"): Gaussians through affine maps, ray space and its local affine approximation,
 * integration along rays, low-pass filters. Pure functions in double precision; splat.h says how
 * splats are made of them.
 *
 * G_V(p) = exp(-p^T V^-1 p / 2) / sqrt((2 pi)^n |V|) is the Gaussian of covariance V, of unit
 * integral over n dimensions (section 4.2). */
#ifndef TRIP_EWA_H
#define TRIP_EWA_H

#include "camera.h"

/* A symmetric 3 x 3 matrix. */
typedef struct trip_covariance {
    double xx, xy, xz, yy, yz, zz;
} trip_covariance;

/* A symmetric 2 x 2 matrix, and its determinant, which is not taken from the elements, whose
 * products may cancel out. */
typedef struct trip_covariance2 {
    double xx, xy, yy, det;
} trip_covariance2;

/* sigma^2 I. */
trip_covariance trip_covariance_round(double sigma);

/* sigma^2 (I - share n n^T): flattened along the unit vector n (section 5). A share of 1 - 1 / s^2
 * is the paper's diag(1, 1, 1 / s^2) turned to n: a kernel s times as flat, of the same integral.
 */
trip_covariance trip_covariance_flattened(double sigma, trip_vec3 n, double share);

/* M V M^T by the linear part of a map M (section 4.3): G_V o M^-1 = |M| G_MVM^T. */
trip_covariance trip_covariance_mapped(const trip_covariance *v, const trip_affine *m);

/* The gradients of the three coordinates of ray space at a point, which are the rows of the
 * Jacobian J (section 4.4): x and y are pixel positions, and `along` is the distance in world units
 * from the eye (in parallel views from its plane, along the ray). */
typedef struct trip_ray_space {
    trip_vec3 x, y, along;
} trip_ray_space;

/* At a point of depth z > 0 in perspective, anywhere in parallel views; index space. */
trip_ray_space trip_ray_space_at(const trip_camera *camera, trip_vec3 from_eye);

/* |J|, positive: units of ray space in one of index space. */
double trip_ray_space_volume(const trip_ray_space *j);

/* J V J^T without its third row and column (section 4.5): with S the result and q pixels from the
 * centre, |J| G_S(q) is the integral of G_V over the world length of the ray there, in the affine
 * approximation. */
trip_covariance2 trip_covariance_integrated(const trip_covariance *v, const trip_ray_space *j);

/* S + h^2 I, the covariance of the convolution of G_S with the low-pass filter G_{h^2 I} (section
 * 4.5). */
trip_covariance2 trip_covariance2_low_passed(const trip_covariance2 *s, double h2);

/* The uniform scaling that section 7 compares with (Swan, Mueller, Moeller, Shareef, Crawfis and
 * Yagel 1997): S times max(1, h^2 / least eigenvalue), so that no axis is shorter than h. */
trip_covariance2 trip_covariance2_scaled(const trip_covariance2 *s, double h2);

/* The conic matrix, S^-1 (section 6). */
trip_covariance2 trip_covariance2_inverse(const trip_covariance2 *s);

#endif
