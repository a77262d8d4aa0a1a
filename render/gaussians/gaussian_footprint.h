/* Projects a Gaussian to the picture in double precision (gaussian_picture.h). Pure functions. */
#ifndef TRIP_GAUSSIAN_FOOTPRINT_H
#define TRIP_GAUSSIAN_FOOTPRINT_H

#include "gaussian_colour.h"
#include "gaussian_picture.h"

/* A footprint in the picture. With d = p - (x, y), the squared radius is
 *     q(p) = N(d) / D(d),   N(d) = (across (d.x - shear d.y))^2 + (down d.y)^2
 * D is 1 for projected footprints. For exact ones it is the squared length of rows[0] + d.x rows[1]
 * + d.y rows[2], where rows[0] has length 1. */
typedef struct trip_gaussian_footprint {
    double x, y, z; /* pixel position of the centre, and its depth (camera.h) */
    double across, shear, down;
    bool curved; /* D is not 1 */
    trip_vec3 rows[3];
    double opacity;          /* at the centre */
    double limit;            /* alpha is below 1/255 where q exceeds it */
    double reach_x, reach_y; /* half extents of the ellipse N(d) <= limit; infinite if it grows by
                                D without bound */
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

/* Sets N of a footprint from the quadratic form's inverse, the covariance. Requires a positive
 * definite one. */
static inline void trip_gaussian_set_ellipse(trip_gaussian_footprint *f, double xx, double xy,
                                             double yy, double determinant)
{
    f->across = sqrt(yy / determinant);
    f->shear = xy / yy;
    f->down = 1 / sqrt(yy);
    f->reach_x = sqrt(f->limit * xx);
    f->reach_y = sqrt(f->limit * yy);
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
        opacity = 1 - pow(1 - fmin(opacity, 1), s->opacity_scale);
    return opacity;
}

/* Computes a footprint by the Jacobian. `f` has its position. Returns false if nothing of it
 * counts. */
static inline bool trip_gaussian_project(const trip_camera *c, const trip_gaussian_settings *s,
                                         const trip_gaussian *g, trip_gaussian_footprint *f)
{
    trip_vec3 jx = c->to_x, jy = c->to_y;
    if (!c->ortho) {
        const double w = 0.5 * c->width, h = 0.5 * c->height, clamp = TRIP_GAUSSIAN_CLAMP;
        const double x = fmin(w * (1 + clamp), fmax(w * (1 - clamp), f->x));
        const double y = fmin(h * (1 + clamp), fmax(h * (1 - clamp), f->y));
        jx = trip_scale(trip_sub(jx, trip_scale(c->forward, x)), 1 / f->z);
        jy = trip_scale(trip_sub(jy, trip_scale(c->forward, y)), 1 / f->z);
    }
    const trip_vec3 deviations = trip_gaussian_deviations(g);
    const trip_vec3 a = trip_vec3_times(trip_gaussian_to_axes(g, jx), deviations);
    const trip_vec3 b = trip_vec3_times(trip_gaussian_to_axes(g, jy), deviations);
    /* The determinant of a sum has no cancellation in this form. */
    const double xx = trip_dot(a, a), xy = trip_dot(a, b), yy = trip_dot(b, b);
    const double bare = trip_dot(trip_cross(a, b), trip_cross(a, b)), add = TRIP_GAUSSIAN_LOW_PASS;
    const double filtered = bare + add * (xx + yy) + add * add;
    double opacity = trip_gaussian_opacity(g, s);
    if (s->antialiased)
        opacity *= sqrt(fmax(TRIP_GAUSSIAN_COMPENSATION_MIN, bare / filtered));
    if (!trip_gaussian_set_opacity(f, opacity))
        return false;
    trip_gaussian_set_ellipse(f, xx + add, xy, yy + add, filtered);
    return isfinite(f->reach_x) && isfinite(f->reach_y) && filtered > 0;
}

/* Computes the footprint of a Gaussian. Returns false if the Gaussian is not drawn, whether it
 * meets the picture or not. */
static inline bool trip_gaussian_footprint_of(const trip_camera *c, const trip_gaussian_settings *s,
                                              const trip_gaussian *g, trip_gaussian_footprint *f)
{
    const trip_vec3 centre = trip_v3(g->centre[0], g->centre[1], g->centre[2]);
    const trip_vec3 from_eye = trip_sub(centre, c->eye);
    if (!trip_gaussian_is_drawn(c, s, centre))
        return false;
    f->z = trip_dot(c->forward, from_eye);
    f->x = trip_dot(c->to_x, from_eye) / (c->ortho ? 1 : f->z);
    f->y = trip_dot(c->to_y, from_eye) / (c->ortho ? 1 : f->z);
    f->curved = false;
    return trip_gaussian_project(c, s, g, f);
}

/* Returns the squared radius q at d = (dx, dy) from the centre. */
static inline double trip_gaussian_radius2(const trip_gaussian_footprint *f, double dx, double dy)
{
    const double u = f->across * (dx - f->shear * dy), v = f->down * dy;
    return u * u + v * v;
}

/* Returns the direction of unit length in scene space that the colour belongs to. */
static inline trip_vec3 trip_gaussian_direction(const trip_camera *c, const trip_gaussian *g)
{
    const trip_vec3 centre = trip_v3(g->centre[0], g->centre[1], g->centre[2]);
    return trip_normalize(c->ortho ? c->r0 : trip_sub(centre, c->eye));
}

#endif
