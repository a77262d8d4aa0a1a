/* The definition of a splat, in formulas. All renderers follow it. reference.c evaluates it in
 * double precision as written; the others may rearrange it. The functions are pure.
 *
 * Kernel
 * ------
 * A voxel at index position v has the extinction tau per world unit. A Gaussian of standard
 * deviation sigma = kernel_radius / TRIP_CUTOFF in index space spreads it. The Gaussian has unit
 * integral over the volume of one voxel. Its line integral along the ray of a pixel position p, at
 * distance d (index space) from v, is
 *     footprint = 1 / (2 pi sigma^2) exp(-d^2 / (2 sigma^2))            [1 / index length]
 *
 * Projection
 * ----------
 * Let (x, y, z) be the projection of v, q = (dx, dy) = p - (x, y), and r_c = r(x, y) the ray
 * through the centre. The vector v - eye is parallel to r_c, so the exact distance is quadratic in
 * q:
 *     d^2 = |dx A + dy B|^2 / |r(p)|^2,  A = (v - eye) x rx,  B = (v - eye) x ry      (perspective)
 *     d^2 = |dx A + dy B|^2 / |r0|^2,    A = r0 x rx,         B = r0 x ry             (parallel)
 * Define g(p) = |r_c|^2 / |r(p)|^2 (1 in parallel views) and the 2 x 2 screen covariance
 *     S = sigma^2 |r_c|^2 ([A.A A.B; A.B B.B])^-1                                     [px^2]
 * Then d^2 / sigma^2 = g(p) q^T S^-1 q.
 *
 * Low-pass filter
 * ---------------
 * EWA volume splatting convolves the footprint with a screen filter (Zwicker et al. 2001). The
 * filter adds to the covariance and keeps the integral:
 *     S' = S + w^2 I,  w = trip_settings_low_pass_px()                                [px^2]
 *     m(p)       = g(p) q^T S'^-1 q                                    squared radius, in std devs
 *     edge       = exp(-TRIP_CUTOFF^2 / 2)
 *     amplitude  = 1 / (2 pi sigma^2) sqrt(|S| / |S'|) / (1 - edge (1 + TRIP_CUTOFF^2 / 2))
 *     footprint' = front(p) amplitude (exp(-m(p) / 2) - edge)
 *                                                       where m(p) <= TRIP_CUTOFF^2, else nothing
 *
 * In a very wide view, a pixel in the middle of the picture spans a large angle. The filter's
 * support would have no end from TRIP_CUTOFF w |rx| = |r_c| on: there g(p) falls as fast as q^2
 * grows. So w is smaller in such views. The filter's rays then differ from r_c by at most
 * TRIP_SPLAT_AFFINE |r_c|, the bound of affine footprints. With the default w, square pixels and
 * cubic voxels, this begins where tan(fov / 2) exceeds 0.1875 times the height in pixels. For 100
 * pixels that is at 174 degrees, for 1024 pixels at 179.4 degrees.
 *
 * The footprint ends at zero, so that rounding at its edge is not visible. The last factor of the
 * amplitude restores the mass that the cut-off removes.
 *
 * Optical depth and opacity
 * -------------------------
 * A ray covers stretch(p) = |J r(p)| / |r(p)| world units per index length, where J is the linear
 * part of index_to_world. So
 *     alpha(p) = 1 - exp(-depth(p)),  depth(p) = tau * stretch(p) * footprint'.
 *
 * Compositing
 * -----------
 * settings.compositing selects the unit that *over* composites.
 *
 * With `splat`, splats are composited one by one, in list order.
 *
 * With `sheet`, the splats i of one sheet of one list are added first. For each channel v of
 * layer.h,
 *     depth(p) = sum of depth_i(p),  alpha(p) = 1 - exp(-depth(p)),
 *     v(p) = sum of depth_i(p) v_i / depth(p)
 * The order of splats within a sheet does not matter, so that a mirrored volume gives the mirrored
 * picture.
 *
 * Sheets are composited in list order, front to back. If a pixel's ray goes up the list's axis, the
 * order is ascending, otherwise descending (trip_ray_goes()). Splats behind the eye that reach in
 * front of it come before the splats beyond the eye, in the order that a ray meets them. Two
 * settings change this:
 * - vertex_weights: all pixels take the sheets beyond the eye's coordinate in ascending order, then
 *   the sheets below it in descending order.
 * - traversal ascending: all pixels take the sheets in one order.
 *
 * Front to back, a pixel takes no more splats or sheets once its transmittance is below
 * trip_settings_early_termination().
 *
 * Support
 * -------
 * The support {m(p) <= TRIP_CUTOFF^2} is the inside of a conic. Write k = TRIP_CUTOFF and
 *     E = S'^-1 - (k^2 / |r_c|^2) [rx.rx rx.ry; rx.ry ry.ry],  l = (k^2 / |r_c|^2) (r_c.rx, r_c.ry)
 * (no second terms in parallel views). If E is positive definite, the support is the ellipse
 *     (q - E^-1 l)^T E (q - E^-1 l) <= k^2 + l^T E^-1 l
 * Its half extents are sqrt((k^2 + l^T E^-1 l) (E^-1)_xx) and _yy.
 *
 * Near splats
 * -----------
 * Only the part of a splat in front of the eye counts. A ray begins at the eye, or in the eye's
 * plane in parallel views. front(p) is the share of the Gaussian on the ray beyond its beginning.
 * Let s(p) be the distance along the ray to the point nearest to v, in standard deviations:
 *     front(p) = 1/2 (1 + erf(s / sqrt 2) / erf(k / sqrt 2)),  0 below s = -k and 1 above s = k.
 * Let R be the kernel's radius, and `radius` the field of trip_splat. A splat is "near" in two
 * cases:
 * - It is not farther from the eye than sqrt(R^2 + radius^2). Otherwise front(p) is 1 on all its
 *   support.
 * - Its support is no ellipse, because it crosses the plane of the eye (Hofsetz & Max 2005, section
 *   4).
 *
 * For near splats z may be 0, so m(p) and |S'| are computed across the ray, with the same values.
 * Let c = v - eye, let e1 and e2 be unit vectors at right angles to c and to one another, and let
 * rho(a) = (e1.a, e2.a). Then
 *     W    = I + (w max(0, z) / sigma)^2 (rho(rx) rho(rx)^T + rho(ry) rho(ry)^T)
 *     m(p) = (|c| / sigma)^2 rho(r(p))^T W^-1 rho(r(p)) / |r(p)|^2,   |S| / |S'| = 1 / |W|
 *     s(p) = c.r(p) / (sigma |r(p)|)
 * Behind the eye there is no low-pass filter. In parallel views the formulas hold with three
 * changes:
 * - e1 and e2 are at right angles to r0.
 * - The vector from the beginning of the ray of p to v replaces |c| r(p) / |r|.
 * - 1 replaces z.
 *
 * EWA footprints
 * --------------
 * With settings.footprint EWA (Zwicker et al. 2001) a footprint is the local affine approximation
 * at the splat's centre. S is the covariance of ray space without its third row and column (ewa.h),
 * equal to the S above. The whole footprint uses g(p) and stretch(p) of its centre:
 *     m(p) = q^T S'^-1 q,  footprint' stretch = 1 / (2 pi sigma^2) sqrt(|S| / |S'|) stretch(x, y)
 *                                               (exp(-m(p) / 2) - edge) / (1 - edge (1 + k^2 / 2))
 * No pixel needs its ray, and the support is an ellipse about (x, y). Parallel views are affine
 * anyway. In perspective the approximation is used if the rays of the support differ from r_c by at
 * most TRIP_SPLAT_AFFINE |r_c|. The renderers take this for granted where
 *     k^2 (S'_xx rx.rx + 2 S'_xy rx.ry + S'_yy ry.ry) <= (TRIP_SPLAT_AFFINE |r_c|)^2.
 * For cubic voxels on the axis of view it holds from 2.8 kernel radii in front of the eye on. Other
 * splats use the formulas of near splats. If settings.low_pass is none, S' is S; ewa.h defines
 * uniform.
 *
 * Fixed footprints
 * ----------------
 * With settings.footprint FIXED (Hofsetz, Max & Bastos 2008, section 5.2) every footprint is a
 * circle of P = settings.sprite_px pixels, as for point sprites. The formulas of EWA hold with S =
 * (P / (2 k))^2 I, wherever the splat lies in front of the eye. The optical depth at the centre,
 * before the low-pass filter, is the same as for the exact footprint. The covered area differs. In
 * parallel views only S is replaced.
 *
 * Flattened kernels
 * -----------------
 * With settings.flatten s > 1 the kernel of a voxel with a gradient is flattened along the gradient
 * (Zwicker et al. 2001, section 5). Its covariance in index space is trip_covariance_flattened(),
 * with the unit vector along the gradient and the share  (1 - 1 / s^2) min(1, |gradient| /
 * gradient_full) (shade.h). Without a surface the kernel stays round. It keeps its integral:
 *     footprint' stretch = stretch(x, y) / (2 pi sigma^2) sqrt(|S of the round kernel| / |S'|) ...
 * Near splats in perspective stay round. Bounds on the reach of a splat are the bounds of round
 * kernels. Only settings.low_pass uniform makes kernels seen edge-on up to s times as large as
 * round ones. Then all bricks in front of the eye are drawn.
 *
 * Uneven spacing
 * --------------
 * With uneven spacing (coordinates.h) a voxel's kernel is as wide along each axis as the voxel,
 * trip_coordinates_width(). All of the above holds in an index space of the voxel's own, where this
 * width is 1 and the kernel round. Weights and the order of sheets still use positions. */
#ifndef TRIP_SPLAT_H
#define TRIP_SPLAT_H

#include <stdbool.h>

#include "camera.h"
#include "coordinates.h"
#include "settings.h"

/* The bound of affine footprints, see above. Every ray of an affine support passes the centre
 * within TRIP_SPLAT_AFFINE_REACH times the radius of the exact splat. */
#define TRIP_SPLAT_AFFINE 0.5
#define TRIP_SPLAT_AFFINE_REACH 2.0

/* Constants of one frame. */
typedef struct trip_splat_frame {
    trip_camera camera;
    bool affine;  /* affine footprints, in perspective */
    double fixed; /* sigma of fixed footprints in pixels; 0 if they are not used */
    trip_low_pass low_pass;
    double flatten;   /* 1 - 1 / s^2; 0 keeps kernels round */
    double sigma;     /* index lengths */
    double cutoff2;   /* TRIP_CUTOFF^2 */
    double low_pass2; /* px^2 */
    double edge;      /* exp(-cutoff2 / 2) */
    double amplitude; /* 1 / (2 pi sigma^2) / (1 - edge (1 + cutoff2 / 2)) */
    double rxrx, rxry, ryry;
    double front; /* 1 / erf(cutoff / sqrt 2) */
} trip_splat_frame;

/* A projected splat. */
typedef struct trip_splat {
    double x, y, z;                      /* pixel position of the centre, and its depth */
    double ray2;                         /* |r_c|^2; 1 in parallel views */
    double conic_xx, conic_xy, conic_yy; /* S'^-1 */
    double amplitude;
    double x0, y0, x1, y1; /* bounds of the support in pixel positions */
    /* Index-space radius that contains every ray of the support. Infinite if unbounded. */
    double radius;
    /* Set for near splats. In perspective m = (a^2 + b^2) / |r|^2 and s = along / |r|; of the
     * fields above only z, amplitude, bounds and radius are set then. In parallel views s = along.
     */
    bool near;
    /* m and stretch use the centre's ray: ray2 is 1, and the amplitude includes the stretch. */
    bool affine;
    double a[3], b[3], along[3]; /* dot products with (1, x, y) for a pixel position (x, y) */
} trip_splat;

/* Returns the constants of a view in an index space with other units. Each axis's `unit` is given
 * in the index lengths of `f`. A kernel that is round there is wider by `unit` along each axis
 * in the space of `f`. Depths stay the same. */
trip_splat_frame trip_splat_frame_scaled(const trip_splat_frame *f, trip_vec3 unit);

/* Returns a voxel's position in the frame in which its kernel is round, and stores that frame. With
 * even spacing the frame is `f`. `growth` is the factor by which lengths may be larger in the index
 * space of `f`. */
trip_vec3 trip_splat_position(const trip_splat_frame *f, const trip_coordinates *coordinates,
                              trip_vec3 voxel, trip_splat_frame *frame, double *growth);

trip_splat_frame trip_splat_frame_make(const trip_camera *camera, const trip_settings *settings);

/* A flattened kernel: along a unit vector in index space, by a share (ewa.h). */
typedef struct trip_flattening {
    trip_vec3 normal;
    double share;
} trip_flattening;

/* Returns the flattening for a voxel with a world-space gradient. */
trip_flattening trip_splat_flattening(const trip_splat_frame *f, const double gradient[3],
                                      double gradient_full);

/* Returns settings.sprite_px by Hofsetz, Max & Bastos 2008, section 5.2: W b |v'c - E| / |vc - E|.
 * - E is the eye, and vc is `middle`, a point of index space.
 * - v'c is the projection of vc on a plane in front of the eye. The picture is W pixels and 2 units
 *   wide on this plane.
 * - b is the radius of a splat at vc across its ray. For an ellipse it is the radius of the circle
 *   with the same area.
 *
 * At a given depth the result does not depend on the angle. Returns 0 if `middle` lies behind the
 * eye. */
double trip_splat_sprite_px(const trip_camera *camera, const trip_settings *settings,
                            trip_vec3 middle);
/* Returns the radius of fixed footprints, including the low-pass filter. */
double trip_splat_fixed_radius_px(const trip_settings *settings);

/* Projects a splat. Returns false if the splat is not drawn: behind the eye, or outside the
 * picture. The bounds of near splats may be larger than their support. */
bool trip_splat_project(const trip_splat_frame *f, trip_vec3 voxel, trip_splat *out);

/* Projects a splat with a flattened kernel. */
bool trip_splat_project_flat(const trip_splat_frame *f, trip_vec3 voxel,
                             const trip_flattening *flat, trip_splat *out);

/* Projects a splat in perspective with the formulas of near splats, which hold at any position. */
bool trip_splat_project_near(const trip_splat_frame *f, trip_vec3 voxel, trip_splat *out);

/* Whether numbers of a projected splat are not finite. The renderer can neither draw such a
 * splat nor know that it is invisible, so the frame must end with trip_splat_fail(). No view that
 * trip_camera_make() accepts has such splats. */
bool trip_splat_is_broken(const trip_splat *s);
int trip_splat_fail(void);

/* Returns m(p) for a pixel position; infinite where front(p) is 0. */
double trip_splat_radius2(const trip_splat_frame *f, const trip_splat *s, double x, double y);

/* Returns front(p) for a pixel position. */
double trip_splat_front(const trip_splat_frame *f, const trip_splat *s, double x, double y);

/* Returns the depth behind the plane of the eye beyond which no splat is drawn. */
double trip_splat_behind(const trip_splat_frame *f);

/* For parallel views: returns the depth from which on splats are not near. Splats at its negative
 * or below are not drawn. */
double trip_splat_parallel_near(const trip_splat_frame *f);

/* Returns the world units per index length along the ray of a pixel position. The amplitude of
 * affine splats already includes it. */
double trip_splat_stretch(const trip_splat_frame *f, double x, double y);

/* The sum of the splats of voxels with one extinction, divided by that extinction. Rays run
 * parallel to an axis of the grid, through voxels or midway between four. The low-pass filter is
 * left out. */
typedef struct trip_splat_ripple {
    double through, between;
} trip_splat_ripple;

trip_splat_ripple trip_splat_ripple_of(double kernel_radius);

#endif
