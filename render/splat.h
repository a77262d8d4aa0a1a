/* What a splat is, in numbers. This page is the definition that all renderers follow; reference.c
 * evaluates it in double precision as written, the others may rearrange it.
 *
 * A voxel at index position v carries extinction tau (per world unit) on a Gaussian of standard
 * deviation sigma = kernel_radius / TRIP_CUTOFF in index space, of unit integral over one voxel's
 * volume. For the ray of a pixel position p at distance d (index space) from v its line integral is
 *     footprint = 1 / (2 pi sigma^2) exp(-d^2 / (2 sigma^2))            [1 / index length]
 * Let (x, y, z) be the projection of v, q = (dx, dy) = p - (x, y), and r_c = r(x, y) the ray
 * through the centre. As v - eye is parallel to r_c, the exact distance is quadratic in q:
 *     d^2 = |dx A + dy B|^2 / |r(p)|^2,  A = (v - eye) x rx,  B = (v - eye) x ry      (perspective)
 *     d^2 = |dx A + dy B|^2 / |r0|^2,    A = r0 x rx,         B = r0 x ry             (parallel)
 * With g(p) = |r_c|^2 / |r(p)|^2 (1 in parallel views) and the 2 x 2 screen covariance
 *     S = sigma^2 |r_c|^2 ([A.A A.B; A.B B.B])^-1                                     [px^2]
 * this reads d^2 / sigma^2 = g(p) q^T S^-1 q. The low-pass of EWA volume splatting (Zwicker et al.
 * 2001, the convolution of the footprint with the screen filter) adds to the covariance and keeps
 * the integral:
 *     S' = S + TRIP_LOW_PASS_PX^2 I
 *     m(p)       = g(p) q^T S'^-1 q                                    squared radius, in std devs
 *     edge       = exp(-TRIP_CUTOFF^2 / 2)
 *     amplitude  = 1 / (2 pi sigma^2) sqrt(|S| / |S'|) / (1 - edge (1 + TRIP_CUTOFF^2 / 2))
 *     footprint' = front(p) amplitude (exp(-m(p) / 2) - edge)
 *                                                       where m(p) <= TRIP_CUTOFF^2, else nothing
 * (the footprint ends at zero, so that rounding at its edge shows nowhere; the last factor of the
 * amplitude gives back the mass that the cut-off takes). A ray covers
 * stretch(p) = |J r(p)| / |r(p)| world units per index length, J being the linear part of
 * index_to_world, so
 *     alpha(p) = 1 - exp(-depth(p)),  depth(p) = tau * stretch(p) * footprint'.
 *
 * Splats are composited by *over* one by one, in list order (settings.compositing: splat), or sheet
 * by sheet (sheet), the splats i of one sheet of one list together as
 *     depth(p) = sum of depth_i(p),  alpha(p) = 1 - exp(-depth(p)),
 *     v(p) = sum of depth_i(p) v_i / depth(p)
 * for each channel v of layer.h, so that their order within the sheet does not matter: a mirrored
 * volume gives the mirrored picture. Sheets are composited in list order: front to back, ascending
 * along the list's axis at pixels whose ray goes up it, descending at the others (trip_ray_goes()),
 * so that splats behind the eye which reach before it come before those beyond, as a ray meets
 * them. With settings.vertex_weights all pixels take the sheets beyond the eye's coordinate in
 * ascending order and then those below it in descending order, and with settings.traversal
 * ascending one order. Front to back, a pixel whose transmittance is below
 * trip_settings_early_termination() takes no more of what is composited.
 *
 * The support {m(p) <= TRIP_CUTOFF^2} is the inside of a conic. Writing k = TRIP_CUTOFF,
 *     E = S'^-1 - (k^2 / |r_c|^2) [rx.rx rx.ry; rx.ry ry.ry],  l = (k^2 / |r_c|^2) (r_c.rx, r_c.ry)
 * (no second terms in parallel views) it is, when E is positive definite, the ellipse
 *     (q - E^-1 l)^T E (q - E^-1 l) <= k^2 + l^T E^-1 l
 * whose half extents are sqrt((k^2 + l^T E^-1 l) (E^-1)_xx) and _yy.
 *
 * Of a splat near the eye counts what lies in front: front(p) is the share of the Gaussian on the
 * ray from where it begins, at the eye or, in parallel views, in the eye's plane. With s(p) the
 * distance along the ray at which it passes nearest to v, in standard deviations,
 *     front(p) = 1/2 (1 + erf(s / sqrt 2) / erf(k / sqrt 2)),  0 below s = -k and 1 above s = k.
 * It is 1 all over the support of a splat farther from the eye than sqrt(R^2 + radius^2), R being
 * the kernel's radius and `radius` that of trip_splat. The others, and those whose support is no
 * ellipse (it crosses the plane of the eye, Hofsetz & Max 2005 section 4), are "near": their m(p)
 * and |S'| are the same numbers worked out across the ray, since z may be 0. With c = v - eye, e1
 * and e2 of unit length at right angles to c and to one another, and rho(a) = (e1.a, e2.a),
 *     W    = I + (TRIP_LOW_PASS_PX max(0, z) / sigma)^2 (rho(rx) rho(rx)^T + rho(ry) rho(ry)^T)
 *     m(p) = (|c| / sigma)^2 rho(r(p))^T W^-1 rho(r(p)) / |r(p)|^2,   |S| / |S'| = 1 / |W|
 *     s(p) = c.r(p) / (sigma |r(p)|)
 * so that behind the eye there is no low-pass. In parallel views all of this holds with e1 and e2
 * at right angles to r0, the vector from where the ray of p begins to v in place of |c| r(p) / |r|,
 * and 1 in place of z.
 *
 * With settings.footprint EWA (Zwicker et al. 2001) a footprint is what the local affine
 * approximation at the splat's centre makes of it: S is the covariance of ray space without its
 * third row and column (ewa.h), the same S as above, and g(p) and stretch(p) are those of the
 * centre all over it,
 *     m(p) = q^T S'^-1 q,  footprint' stretch = 1 / (2 pi sigma^2) sqrt(|S| / |S'|) stretch(x, y)
 *                                               (exp(-m(p) / 2) - edge) / (1 - edge (1 + k^2 / 2))
 * so that no pixel needs its ray, and the support is an ellipse about (x, y). Parallel views are
 * affine as they are. In perspective the approximation is used where the rays of the support
 * differ from r_c by at most TRIP_SPLAT_AFFINE |r_c|, taken for granted where
 *     k^2 (S'_xx rx.rx + 2 S'_xy rx.ry + S'_yy ry.ry) <= (TRIP_SPLAT_AFFINE |r_c|)^2:
 * of cubes on the axis of view that is from 2.8 kernel radii off the eye on. Other splats have
 * the numbers of near ones. With settings.low_pass none S' is S; uniform, see ewa.h.
 *
 * With settings.footprint FIXED (Hofsetz, Max & Bastos 2008, section 5.2) every footprint is a
 * circle of settings.sprite_px P pixels, as point sprites are: S = (P / (2 k))^2 I, in the formulas
 * of EWA, wherever the splat lies in front of the eye. Its optical depth at the centre, before the
 * low-pass, is that of the exact footprint; what it covers is not. In parallel views only S is
 * replaced.
 *
 * With settings.flatten s > 1 the kernel of a voxel with gradient is flattened along it (section 5
 * of the same paper): its covariance in index space is that of trip_covariance_flattened() with the
 * unit vector along the gradient there and the share  (1 - 1 / s^2) min(1, |gradient| /
 * gradient_full) (shade.h), so that where there is no surface it stays round. It keeps its
 * integral: footprint' stretch = stretch(x, y) / (2 pi sigma^2) sqrt(|S of the round kernel| /
 * |S'|) ... Near splats in perspective stay round; bounds on what a splat reaches are those of
 * round ones, but with settings.low_pass uniform, which makes what is seen edge-on up to s times as
 * large as it would make a round kernel: then all bricks before the eye are drawn.
 *
 * With uneven spacing (coordinates.h) a voxel's kernel is as wide along each axis as the voxel is,
 * trip_coordinates_width(): all of the above is in an index space of its own, in which that is 1
 * and the kernel round. Weights and the order of sheets stay those of places. */
#ifndef TRIP_SPLAT_H
#define TRIP_SPLAT_H

#include <stdbool.h>

#include "camera.h"
#include "coordinates.h"
#include "settings.h"

/* See above; and every ray of an affine support passes within so many times the radius that the
 * exact one would have. */
#define TRIP_SPLAT_AFFINE 0.5
#define TRIP_SPLAT_AFFINE_REACH 2.0

/* Constants of one frame. */
typedef struct trip_splat_frame {
    trip_camera camera;
    bool affine;  /* footprints by the affine map, in perspective */
    double fixed; /* sigma of fixed footprints, pixels; 0: they are not */
    trip_low_pass low_pass;
    double flatten;   /* 1 - 1 / s^2; 0: kernels are round */
    double sigma;     /* index space */
    double cutoff2;   /* TRIP_CUTOFF^2 */
    double low_pass2; /* px^2 */
    double edge;      /* exp(-cutoff2 / 2) */
    double amplitude; /* 1 / (2 pi sigma^2) / (1 - edge (1 + cutoff2 / 2)) */
    double rxrx, rxry, ryry;
    double front; /* 1 / erf(cutoff / sqrt 2) */
} trip_splat_frame;

/* A projected splat. */
typedef struct trip_splat {
    double x, y, z;                      /* pixel position of the centre and depth */
    double ray2;                         /* |r_c|^2; 1 in parallel views */
    double conic_xx, conic_xy, conic_yy; /* S'^-1 */
    double amplitude;
    double x0, y0, x1, y1; /* bounds of the support in pixel positions */
    double radius; /* index-space radius that contains every ray of the support; infinite: any */
    /* Of near splats in perspective the numbers above, but for z, amplitude, bounds and radius, are
     * not set, and m = (a^2 + b^2) / |r|^2 and s = along / |r|; in parallel views s = along. */
    bool near;
    bool affine; /* m and stretch by the centre's ray: ray2 is 1, and the amplitude has the stretch
                  */
    double a[3], b[3], along[3]; /* of a pixel position (x, y): the dot products with (1, x, y) */
} trip_splat;

/* The same of a view whose index space has other units, each axis's `unit` as long as those of
 * `f`: in which a kernel is round that is so much wider along each axis there. Depths keep theirs.
 */
trip_splat_frame trip_splat_frame_scaled(const trip_splat_frame *f, trip_vec3 unit);

/* Of a voxel of a grid: the frame in which its kernel is round, `f` itself where spacing is even,
 * and where the voxel lies there; lengths are up to `growth` times as long in that of `f`. */
trip_vec3 trip_splat_position(const trip_splat_frame *f, const trip_coordinates *coordinates,
                              trip_vec3 voxel, trip_splat_frame *frame, double *growth);

trip_splat_frame trip_splat_frame_make(const trip_camera *camera, const trip_settings *settings);

/* How a kernel is flattened: along a unit vector in index space, by a share (ewa.h). */
typedef struct trip_flattening {
    trip_vec3 normal;
    double share;
} trip_flattening;

/* Of a voxel with this world-space gradient. */
trip_flattening trip_splat_flattening(const trip_splat_frame *f, const double gradient[3],
                                      double gradient_full);

/* What settings.sprite_px is by the paper: W b |v'c - E| / |vc - E|, with vc `middle`, a point of
 * index space, v'c its projection on a plane before the eye E on which the picture is W pixels and
 * 2 units wide, and b the radius of a splat there, across its ray (that of the circle as large
 * where it is an ellipse). At a given depth it does not depend on the angle. 0: it lies behind the
 * eye. */
double trip_splat_sprite_px(const trip_camera *camera, const trip_settings *settings,
                            trip_vec3 middle);
/* How far fixed footprints reach, low-pass included. */
double trip_splat_fixed_radius_px(const trip_settings *settings);

/* False when the splat is not drawn (behind the eye, or out of the picture beside it). The bounds
 * of near splats may be wider than their support. */
bool trip_splat_project(const trip_splat_frame *f, trip_vec3 voxel, trip_splat *out);

/* The same of a flattened kernel. */
bool trip_splat_project_flat(const trip_splat_frame *f, trip_vec3 voxel,
                             const trip_flattening *flat, trip_splat *out);

/* In perspective, by the numbers of near ones, wherever it lies: those are m(p) and the rest too.
 */
bool trip_splat_project_near(const trip_splat_frame *f, trip_vec3 voxel, trip_splat *out);

/* Whether numbers of a splat just projected are not finite, so that it can neither be drawn nor be
 * known not to show: the frame is to end with trip_splat_fail(). No view that trip_camera_make()
 * accepts has such splats. */
bool trip_splat_is_broken(const trip_splat *s);
int trip_splat_fail(void);

/* m(p) for a pixel position; infinite where front(p) is 0. */
double trip_splat_radius2(const trip_splat_frame *f, const trip_splat *s, double x, double y);

/* front(p) for a pixel position. */
double trip_splat_front(const trip_splat_frame *f, const trip_splat *s, double x, double y);

/* How far behind the plane of the eye (as a depth z) no splat is drawn any more. */
double trip_splat_behind(const trip_splat_frame *f);

/* In parallel views: the depth from which on splats are not near, and up to which, negated, they
 * are not drawn. */
double trip_splat_parallel_near(const trip_splat_frame *f);

/* World units per index length along the ray of a pixel position; of affine splats the amplitude
 * has it. */
double trip_splat_stretch(const trip_splat_frame *f, double x, double y);

/* What voxels of one extinction add up to, over that extinction, along rays parallel to an axis of
 * the grid: those through voxels, and those midway between four. Without low-pass. */
typedef struct trip_splat_ripple {
    double through, between;
} trip_splat_ripple;

trip_splat_ripple trip_splat_ripple_of(double kernel_radius);

#endif
