/* The definition of the picture of a Gaussian scene, and its settings. Kerbl et al. 2023 (3D
 * Gaussian Splatting) define it so, and scenes are trained for it. All renderers follow it.
 *
 * Scene space is the index space of the camera (camera.h): its index_to_world places the scene. A
 * scene must be placed by a similarity, since the low-pass filter and the near plane count lengths.
 *
 * Footprint (gaussian_footprint.h)
 * --------------------------------
 * Let (X, Y) be the pixel position of the centre, z its depth and S its covariance in scene space.
 * The rows of the 2 x 3 Jacobian J of the projection are:
 *
 *     (to_x - X' forward) / z,  (to_y - Y' forward) / z      in perspective
 *     to_x,  to_y                                            in parallel views
 *
 * X' is X limited to TRIP_GAUSSIAN_CLAMP half widths from the middle of the picture. Y' is Y
 * limited to as many half heights. This limits x/z to 1.3 tan(fov / 2) of each axis. The screen
 * covariance S2 in px^2, the opacity o' at the centre and the opacity alpha at a pixel centre p
 * follow:
 *
 *     S2 = J S J^T + TRIP_GAUSSIAN_LOW_PASS I
 *     o' = (1 - (1 - min(0.99, o))^opacity_scale) m,   m = sqrt(max(0.000025, |J S J^T| / |S2|))
 *     alpha(p) = min(0.99, o' exp(-q / 2)),  q = d^T S2^-1 d,  d = p - (X, Y)
 *
 * With opacity_scale 1, o' is o m. For scenes that are not antialiased, m is 1. An alpha below
 * 1/255 counts as 0. No other bound cuts the footprint off.
 *
 * With the exact footprint, J is not limited. Let R and s be the rotation and the deviations, r(p)
 * the ray through p, and V = diag(s2 s3, s1 s3, s1 s2) R^T. Then:
 *
 *     q = d^T S2^-1 d |V r(X, Y)|^2 / |V r(p)|^2
 *
 * Where V r(p) . V r(X, Y) is not positive, alpha is 0. Without the low-pass filter, this is the
 * squared distance of the centre from the ray in standard deviations: the minimum along the ray. If
 * s3 is 0, the Gaussian is a flat ellipse. Then q belongs to the point where the ray meets its
 * plane. If a flat one is seen edge-on, the factor is 1.
 *
 * With the EWA footprint, J is not limited either, and m is sqrt(|J S J^T| / |S2|): the filter
 * keeps the footprint's mass.
 *
 * A sample of a range image counts less from other directions than from its camera (Hofsetz and Max
 * 2005, section 6). Let c be the cosine of the angle at the centre between the rays from the eye
 * and from the camera. o' has the factor max(0, c)^4. Coarse Gaussians have no such factor.
 *
 * A footprint that reaches TRIP_GAUSSIAN_REACH_MAX is left out.
 *
 * Compositing
 * -----------
 * Gaussians are drawn in the order in which they come. The order of the definition is by depth z of
 * the centres, nearest first. Centres with z up to TRIP_GAUSSIAN_NEAR scene units in perspective,
 * and up to 0 in parallel views, are dropped. So are centres outside the clip. Each step front to
 * back is:
 *
 *     colour += T alpha rgb,   T *= 1 - alpha
 *
 * A pixel stops when T (1 - alpha) would fall below `early_termination`. That Gaussian and all
 * further ones are not added at this pixel. gaussian_colour.h defines rgb: display values, which
 * are blended as they are. The background comes behind everything with the remaining T.
 *
 * layer.h defines the distance of a pixel. The depth of a Gaussian is the depth of its centre. */
#ifndef TRIP_GAUSSIAN_PICTURE_H
#define TRIP_GAUSSIAN_PICTURE_H

#include <stdbool.h>

#include "camera.h"
#include "clip.h"
#include "gaussian.h"
#include "settings.h"

#define TRIP_GAUSSIAN_CLAMP 1.3
#define TRIP_GAUSSIAN_LOW_PASS 0.3   /* px^2 */
#define TRIP_GAUSSIAN_NEAR 0.2       /* scene units */
#define TRIP_GAUSSIAN_REACH_MAX 1e15 /* px */
#define TRIP_GAUSSIAN_COLOUR_MAX 1e30
#define TRIP_GAUSSIAN_ALPHA_MAX 0.99
#define TRIP_GAUSSIAN_ALPHA_MIN (1.0 / 255)
#define TRIP_GAUSSIAN_TERMINATION 1e-4
#define TRIP_GAUSSIAN_COMPENSATION_MIN 0.000025

typedef enum trip_gaussian_shape {
    TRIP_GAUSSIAN_PROJECTED, /* by the Jacobian at the centre, as scenes are trained */
    TRIP_GAUSSIAN_EXACT,     /* by the distance from each pixel's ray */
    TRIP_GAUSSIAN_EWA,       /* by the Jacobian without limits (Zwicker et al. 2001) */
} trip_gaussian_shape;

typedef struct trip_gaussian_settings {
    int degree;       /* of spherical harmonics that are drawn: 0 to TRIP_SH_DEGREE_MAX */
    bool antialiased; /* the scene was trained with compensated opacity ("antialiased", "mip") */
    trip_gaussian_shape shape;
    double opacity_scale;       /* factor of the optical depth at the centre; 0 means 1 */
    double early_termination;   /* 0 means TRIP_GAUSSIAN_TERMINATION */
    trip_clip clip;             /* scene space; a Gaussian is drawn if its centre is inside */
    double background[4];       /* r, g, b, a; not premultiplied */
    const trip_settings *light; /* on surfels (surfel_light.h); NULL: none */
    bool depth;                 /* also computes distances */
    bool front; /* surfels with a front side are drawn from there alone (deferred) */
} trip_gaussian_settings;

static inline double trip_gaussian_termination(const trip_gaussian_settings *s)
{
    return s->early_termination > 0 ? s->early_termination : TRIP_GAUSSIAN_TERMINATION;
}

#endif
