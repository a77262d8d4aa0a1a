/* The covariance algebra of EWA volume splatting (Zwicker, Pfister, van Baar and Gross 2001, "EWA
 * volume splatting"): Gaussians under affine maps, ray space and its local affine approximation,
 * integration along rays, low-pass filters. splat.h builds splats from them. Pure functions in
 * double precision.
 *
 * G_V(p) = exp(-p^T V^-1 p / 2) / sqrt((2 pi)^n |V|) is the Gaussian of covariance V with unit
 * integral over n dimensions (section 4.2). */
#ifndef TRIP_EWA_H
#define TRIP_EWA_H

#include "camera.h"

/* A symmetric 3 x 3 matrix. */
typedef struct trip_covariance {
    double xx, xy, xz, yy, yz, zz;
} trip_covariance;

/* A symmetric 2 x 2 matrix, and its determinant. The determinant is not computed from the elements,
 * because their products can cancel. */
typedef struct trip_covariance2 {
    double xx, xy, yy, det;
} trip_covariance2;

/* Returns sigma^2 I. */
trip_covariance trip_covariance_round(double sigma);

/* Returns sigma^2 (I - share n n^T), flattened along the unit vector n (section 5). A share of 1 -
 * 1 / s^2 is the paper's diag(1, 1, 1 / s^2) turned to n: a kernel s times flatter. */
trip_covariance trip_covariance_flattened(double sigma, trip_vec3 n, double share);

/* Returns M V M^T for the linear part of a map M (section 4.3): G_V o M^-1 = |M| G_MVM^T. */
trip_covariance trip_covariance_mapped(const trip_covariance *v, const trip_affine *m);

/* The gradients of the three coordinates of ray space at a point: the rows of the Jacobian J
 * (section 4.4). x and y are pixel positions. `along` is the world distance along the ray from the
 * eye, or from its plane in parallel views. */
typedef struct trip_ray_space {
    trip_vec3 x, y, along;
} trip_ray_space;

/* Computes ray space at a point in index space. In perspective its depth z must be above 0. */
trip_ray_space trip_ray_space_at(const trip_camera *camera, trip_vec3 from_eye);

/* Returns |J| > 0, the volume in ray space of a unit volume in index space. */
double trip_ray_space_volume(const trip_ray_space *j);

/* Returns S, the matrix J V J^T without its third row and column (section 4.5). At q pixels from
 * the centre, |J| G_S(q) is the integral of G_V along the ray in world length, in the affine
 * approximation. */
trip_covariance2 trip_covariance_integrated(const trip_covariance *v, const trip_ray_space *j);

/* Returns S + h^2 I, the covariance after convolution of G_S with the low-pass filter G_{h^2 I}
 * (section 4.5). */
trip_covariance2 trip_covariance2_low_passed(const trip_covariance2 *s, double h2);

/* Returns S times max(1, h^2 / minimum eigenvalue), so that no axis is shorter than h. This is the
 * uniform scaling of Swan, Mueller, Moeller, Shareef, Crawfis and Yagel 1997, which section 7
 * compares with. */
trip_covariance2 trip_covariance2_scaled(const trip_covariance2 *s, double h2);

/* Returns the conic matrix S^-1 (section 6). */
trip_covariance2 trip_covariance2_inverse(const trip_covariance2 *s);

#endif
