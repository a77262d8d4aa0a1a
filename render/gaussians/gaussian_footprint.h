/* Projects a Gaussian to the picture in double precision (gaussian_picture.h). Pure functions. */
#ifndef TRIP_GAUSSIAN_FOOTPRINT_H
#define TRIP_GAUSSIAN_FOOTPRINT_H

#include "gaussian_colour.h"
#include "gaussian_picture.h"

/* A footprint in the picture. With d = p - (x, y), the squared radius is q(p) = N / D:
 *
 *     N = (across (d.x - shear d.y))^2 + (down d.y)^2
 *     D = w^2 + (tilt d.x + skew d.y)^2 + (turn d.y)^2,   w = 1 + bend_x d.x + bend_y d.y
 *
 * It is infinite where w <= 0. D is 1 unless the footprint is curved. */
typedef struct trip_gaussian_footprint {
    double x, y, z; /* pixel position of the centre, and its depth (camera.h) */
    double across, shear, down;
    bool curved;
    double bend_x, bend_y, tilt, skew, turn;
    double opacity;          /* at the centre */
    double limit;            /* alpha is below 1/255 where q exceeds it */
    double reach_x, reach_y; /* half extents of the ellipse N <= limit */
    double lo[2], hi[2];     /* bounds of the pixel positions with q <= limit */
} trip_gaussian_footprint;

/* Returns a scene vector in the Gaussian's principal axes. */
static inline trip_vec3 trip_gaussian_to_axes(const trip_gaussian *g, trip_vec3 v)
{
    const double w = (double)g->rotation[0], x = (double)g->rotation[1];
    const double y = (double)g->rotation[2], z = (double)g->rotation[3];
    return trip_v3(
        (1 - 2 * (y * y + z * z)) * v.x + 2 * (x * y + w * z) * v.y + 2 * (x * z - w * y) * v.z,
        2 * (x * y - w * z) * v.x + (1 - 2 * (x * x + z * z)) * v.y + 2 * (y * z + w * x) * v.z,
        2 * (x * z + w * y) * v.x + 2 * (y * z - w * x) * v.y + (1 - 2 * (x * x + y * y)) * v.z);
}

/* Returns the deviations, components of a vector in the principal axes. */
static inline trip_vec3 trip_gaussian_deviations(const trip_gaussian *g)
{
    return trip_v3((double)g->deviations[0], (double)g->deviations[1], (double)g->deviations[2]);
}

/* Whether a centre in scene space is drawn: inside the clip, and not too near to the eye. */
static inline bool trip_gaussian_is_drawn(const trip_camera *c, const trip_gaussian_settings *s,
                                          trip_vec3 centre)
{
    double near = c->ortho ? 0 : TRIP_GAUSSIAN_NEAR * trip_length(c->forward);
    if (!(trip_dot(c->forward, trip_sub(centre, c->eye)) > near))
        return false;
    for (int i = 0; i < s->clip.count; i++)
        if (!(trip_dot(s->clip.planes[i].normal, centre) + s->clip.planes[i].offset >= 0))
            return false;
    return true;
}

/* Sets N of a footprint and its bounds from a covariance in px^2, which must be positive definite.
 */
static inline void trip_gaussian_set_ellipse(trip_gaussian_footprint *f, double xx, double xy,
                                             double yy, double determinant)
{
    f->across = sqrt(yy / determinant);
    f->shear = xy / yy;
    f->down = 1 / sqrt(yy);
    f->reach_x = sqrt(f->limit * xx);
    f->reach_y = sqrt(f->limit * yy);
    f->lo[0] = f->x - f->reach_x;
    f->hi[0] = f->x + f->reach_x;
    f->lo[1] = f->y - f->reach_y;
    f->hi[1] = f->y + f->reach_y;
}

/* Sets the bounds of a curved footprint. N <= limit D is an ellipse about another point, or it has
 * no bounds: then TRIP_GAUSSIAN_REACH_MAX stands for them. */
static inline void trip_gaussian_set_curved_bounds(trip_gaussian_footprint *f)
{
    const double k = f->limit, a = f->across, b = a * f->shear;
    const double xx = a * a - k * (f->bend_x * f->bend_x + f->tilt * f->tilt);
    const double xy = -a * b - k * (f->bend_x * f->bend_y + f->tilt * f->skew);
    const double yy = b * b + f->down * f->down -
                      k * (f->bend_y * f->bend_y + f->skew * f->skew + f->turn * f->turn);
    const double determinant = xx * yy - xy * xy, lx = k * f->bend_x, ly = k * f->bend_y;
    f->lo[0] = f->lo[1] = -TRIP_GAUSSIAN_REACH_MAX;
    f->hi[0] = f->hi[1] = TRIP_GAUSSIAN_REACH_MAX;
    /* A nearly singular form has no certain bounds. */
    if (!(xx > 0 && yy > 0 && determinant > 1e-9 * xx * yy))
        return;
    const double x = (yy * lx - xy * ly) / determinant, y = (xx * ly - xy * lx) / determinant;
    const double radius2 = k + lx * x + ly * y;
    const double wide = sqrt(radius2 * yy / determinant), high = sqrt(radius2 * xx / determinant);
    f->lo[0] = f->x + x - wide;
    f->hi[0] = f->x + x + wide;
    f->lo[1] = f->y + y - high;
    f->hi[1] = f->y + y + high;
}

/* Sets D of an exact footprint. */
static inline void trip_gaussian_curve(const trip_camera *c, const trip_gaussian *g,
                                       trip_gaussian_footprint *f)
{
    const trip_vec3 s = trip_gaussian_deviations(g);
    const double most = fmax(s.x, fmax(s.y, s.z));
    const trip_vec3 t = trip_scale(s, 1 / most), v = trip_v3(t.y * t.z, t.x * t.z, t.x * t.y);
    const trip_vec3 r =
        trip_vec3_times(v, trip_gaussian_to_axes(g, trip_camera_ray(c, f->x, f->y)));
    const double length = trip_length(r);
    if (c->ortho || !(length > 0))
        return;
    const trip_vec3 along = trip_scale(r, 1 / length);
    trip_vec3 x = trip_scale(trip_vec3_times(v, trip_gaussian_to_axes(g, c->rx)), 1 / length);
    trip_vec3 y = trip_scale(trip_vec3_times(v, trip_gaussian_to_axes(g, c->ry)), 1 / length);
    f->curved = true;
    f->bend_x = trip_dot(along, x);
    f->bend_y = trip_dot(along, y);
    x = trip_sub(x, trip_scale(along, f->bend_x));
    y = trip_sub(y, trip_scale(along, f->bend_y));
    f->tilt = trip_length(x);
    f->skew = f->tilt > 0 ? trip_dot(x, y) / f->tilt : 0;
    f->turn = f->tilt > 0 ? trip_length(trip_cross(x, y)) / f->tilt : trip_length(y);
    trip_gaussian_set_curved_bounds(f);
}

/* Sets the limit of a footprint from its opacity. Returns false if nothing of it counts. */
static inline bool trip_gaussian_set_opacity(trip_gaussian_footprint *f, double opacity)
{
    f->opacity = opacity;
    f->limit = 2 * log(opacity / TRIP_GAUSSIAN_ALPHA_MIN);
    return opacity >= TRIP_GAUSSIAN_ALPHA_MIN;
}

/* Returns the opacity at the centre after scaling. */
static inline double trip_gaussian_opacity(const trip_gaussian *g, const trip_gaussian_settings *s)
{
    double opacity = (double)g->opacity;
    if (s->opacity_scale > 0 && s->opacity_scale != 1)
        opacity = 1 - pow(1 - fmin(opacity, TRIP_GAUSSIAN_ALPHA_MAX), s->opacity_scale);
    return opacity;
}

/* Returns the direction of unit length in scene space that the colour belongs to. */
static inline trip_vec3 trip_gaussian_direction(const trip_camera *c, const trip_gaussian *g)
{
    const trip_vec3 centre = trip_v3(g->centre[0], g->centre[1], g->centre[2]);
    return trip_normalize(c->ortho ? c->r0 : trip_sub(centre, c->eye));
}

/* Returns the share of its opacity that a sample of a range image keeps. */
static inline double trip_gaussian_facing(const trip_camera *c, const trip_gaussian *g)
{
    const double cosine = -trip_gaussian_to_axes(g, trip_gaussian_direction(c, g)).z;
    const double square = cosine > 0 ? cosine * cosine : 0;
    return square * square;
}

/* Sets the rows of the Jacobian at a footprint's position and depth. */
static inline void trip_gaussian_jacobian(const trip_camera *c, trip_gaussian_shape shape,
                                          const trip_gaussian_footprint *f, trip_vec3 *jx,
                                          trip_vec3 *jy)
{
    const bool limited = shape == TRIP_GAUSSIAN_PROJECTED;
    *jx = c->to_x;
    *jy = c->to_y;
    if (c->ortho)
        return;
    const double w = 0.5 * c->width, h = 0.5 * c->height, clamp = TRIP_GAUSSIAN_CLAMP;
    const double x = !limited ? f->x : fmin(w * (1 + clamp), fmax(w * (1 - clamp), f->x));
    const double y = !limited ? f->y : fmin(h * (1 + clamp), fmax(h * (1 - clamp), f->y));
    *jx = trip_scale(trip_sub(*jx, trip_scale(c->forward, x)), 1 / f->z);
    *jy = trip_scale(trip_sub(*jy, trip_scale(c->forward, y)), 1 / f->z);
}

/* Sets the rows of J R diag(deviations). */
static inline void trip_gaussian_to_picture(const trip_camera *c, const trip_gaussian *g,
                                            trip_gaussian_shape shape,
                                            const trip_gaussian_footprint *f, trip_vec3 *a,
                                            trip_vec3 *b)
{
    trip_vec3 jx, jy;
    trip_gaussian_jacobian(c, shape, f, &jx, &jy);
    const trip_vec3 deviations = trip_gaussian_deviations(g);
    *a = trip_vec3_times(trip_gaussian_to_axes(g, jx), deviations);
    *b = trip_vec3_times(trip_gaussian_to_axes(g, jy), deviations);
}

/* Sets the shape and the opacity of a footprint from its position. Returns false if nothing of it
 * counts. */
static inline bool trip_gaussian_project(const trip_camera *c, const trip_gaussian_settings *s,
                                         const trip_gaussian *g, trip_gaussian_footprint *f)
{
    trip_vec3 a, b;
    trip_gaussian_to_picture(c, g, s->shape, f, &a, &b);
    /* The determinant of a sum has no cancellation in this form. */
    const double xx = trip_dot(a, a), xy = trip_dot(a, b), yy = trip_dot(b, b);
    const double bare = trip_dot(trip_cross(a, b), trip_cross(a, b)), add = TRIP_GAUSSIAN_LOW_PASS;
    const double filtered = bare + add * (xx + yy) + add * add;
    double opacity = trip_gaussian_opacity(g, s);
    if (g->from_camera)
        opacity *= trip_gaussian_facing(c, g);
    if (s->shape == TRIP_GAUSSIAN_EWA)
        opacity *= sqrt(bare / filtered);
    else if (s->antialiased || g->antialiased)
        opacity *= sqrt(fmax(TRIP_GAUSSIAN_COMPENSATION_MIN, bare / filtered));
    if (!trip_gaussian_set_opacity(f, opacity))
        return false;
    trip_gaussian_set_ellipse(f, xx + add, xy, yy + add, filtered);
    const double max = TRIP_GAUSSIAN_REACH_MAX;
    if (!(f->reach_x < max && f->reach_y < max && fabs(f->x) < max && fabs(f->y) < max))
        return false;
    if (s->shape == TRIP_GAUSSIAN_EXACT)
        trip_gaussian_curve(c, g, f);
    return true;
}

/* Returns a footprint with the position of a Gaussian alone. */
static inline trip_gaussian_footprint trip_gaussian_position(const trip_camera *c,
                                                             const trip_gaussian *g)
{
    const trip_vec3 from_eye = trip_sub(trip_v3(g->centre[0], g->centre[1], g->centre[2]), c->eye);
    const double z = trip_dot(c->forward, from_eye), by = c->ortho ? 1 : z;
    return (trip_gaussian_footprint){ .x = trip_dot(c->to_x, from_eye) / by,
                                      .y = trip_dot(c->to_y, from_eye) / by,
                                      .z = z };
}

/* Computes the footprint of a Gaussian. Returns false if the Gaussian is not drawn, whether it
 * meets the picture or not. */
static inline bool trip_gaussian_footprint_of(const trip_camera *c, const trip_gaussian_settings *s,
                                              const trip_gaussian *g, trip_gaussian_footprint *f)
{
    const trip_vec3 centre = trip_v3(g->centre[0], g->centre[1], g->centre[2]);
    if (!trip_gaussian_is_drawn(c, s, centre))
        return false;
    *f = trip_gaussian_position(c, g);
    return trip_gaussian_project(c, s, g, f);
}

/* Returns the share of its opacity that a drawn Gaussian keeps, so that the low-pass filter does
 * not change the light that it blocks. */
static inline double trip_gaussian_compensation(const trip_camera *c, const trip_gaussian *g)
{
    const trip_gaussian_footprint f = trip_gaussian_position(c, g);
    const double add = TRIP_GAUSSIAN_LOW_PASS;
    trip_vec3 a, b;
    if (!(f.z > 0))
        return 1;
    trip_gaussian_to_picture(c, g, TRIP_GAUSSIAN_PROJECTED, &f, &a, &b);
    const trip_vec3 cross = trip_cross(a, b);
    const double bare = trip_dot(cross, cross);
    return sqrt(bare / (bare + add * (trip_dot(a, a) + trip_dot(b, b)) + add * add));
}

/* Returns the squared radius q at d = (dx, dy) from the centre. */
static inline double trip_gaussian_radius2(const trip_gaussian_footprint *f, double dx, double dy)
{
    const double u = f->across * (dx - f->shear * dy), v = f->down * dy;
    if (!f->curved)
        return u * u + v * v;
    const double w = 1 + f->bend_x * dx + f->bend_y * dy;
    const double a = f->tilt * dx + f->skew * dy, b = f->turn * dy;
    return w > 0 ? (u * u + v * v) / (w * w + a * a + b * b) : INFINITY;
}

/* Returns the maximum length of the rows of J times z over all pixel positions that the Jacobian is
 * limited to. Without perspective, z is 1. */
static inline double trip_gaussian_stretch(const trip_camera *c, trip_vec3 to, int size)
{
    if (c->ortho)
        return trip_length(to);
    const double half = 0.5 * size, reach = half * TRIP_GAUSSIAN_CLAMP;
    return fmax(trip_length(trip_sub(to, trip_scale(c->forward, half - reach))),
                trip_length(trip_sub(to, trip_scale(c->forward, half + reach))));
}

/* Computes pixel bounds of all footprints with a limited Jacobian that have a centre in the box and
 * deviations up to `deviation`. The bounds are infinite if the box crosses the near plane. Returns
 * false if it is behind that plane. */
static inline bool trip_gaussian_box_bounds(const trip_camera *c, const double box_lo[3],
                                            const double box_hi[3], double deviation, double lo[2],
                                            double hi[2])
{
    const double near = c->ortho ? 0 : TRIP_GAUSSIAN_NEAR * trip_length(c->forward);
    double nearest = INFINITY, farthest = -INFINITY;
    lo[0] = lo[1] = INFINITY;
    hi[0] = hi[1] = -INFINITY;
    for (int i = 0; i < 8; i++) {
        const trip_vec3 corner =
            trip_v3(i & 1 ? box_hi[0] : box_lo[0], i & 2 ? box_hi[1] : box_lo[1],
                    i & 4 ? box_hi[2] : box_lo[2]);
        const trip_vec3 from_eye = trip_sub(corner, c->eye);
        const double z = trip_dot(c->forward, from_eye), by = c->ortho ? 1 : z;
        const double at[2] = { trip_dot(c->to_x, from_eye) / by, trip_dot(c->to_y, from_eye) / by };
        nearest = fmin(nearest, z);
        farthest = fmax(farthest, z);
        for (int k = 0; k < 2; k++) {
            lo[k] = fmin(lo[k], at[k]);
            hi[k] = fmax(hi[k], at[k]);
        }
    }
    const double limit = -2 * log(TRIP_GAUSSIAN_ALPHA_MIN), by = c->ortho ? 1 : nearest;
    for (int k = 0; k < 2; k++) {
        const double stretch =
            trip_gaussian_stretch(c, k ? c->to_y : c->to_x, k ? c->height : c->width);
        const double wide = deviation * stretch / by;
        const double reach =
            nearest > near ? sqrt(limit * (wide * wide + TRIP_GAUSSIAN_LOW_PASS)) : INFINITY;
        lo[k] -= reach + 1e-6; /* for rounding */
        hi[k] += reach + 1e-6;
    }
    return farthest > near;
}

#endif
