/* Projects a surfel to the picture in double precision (surfel_picture.h). Pure functions. */
#ifndef TRIP_SURFEL_FOOTPRINT_H
#define TRIP_SURFEL_FOOTPRINT_H

#include "gaussian_footprint.h"
#include "surfel_picture.h"

/* An ellipse: with d = p - (x, y), u = (across (d.x - shear d.y))^2 + (down d.y)^2. */
typedef struct trip_surfel_ellipse {
    double across, shear, down;
} trip_surfel_ellipse;

/* The depth z(p) is v in
 * parallel views and 1 / v in perspective, with v = base + slope_x d.x + slope_y d.y, limited to
 * [near, far]. Where v <= 0 in perspective, it is far. */
typedef struct trip_surfel_footprint {
    double x, y, z;
    trip_surfel_ellipse blend, disc; /* q and u */
    double base, slope_x, slope_y, near, far;
    double tolerance, front; /* front: z' - t, at least 0 */
    double mass;             /* weight at the centre */
    double reach_x, reach_y; /* half extents of the ellipse q <= TRIP_SURFEL_REACH */
} trip_surfel_footprint;

/* Returns the deviations that a surfel is drawn with. */
static inline trip_vec3 trip_surfel_deviations(const trip_gaussian *g)
{
    return trip_scale(trip_gaussian_deviations(g), g->merged ? TRIP_SURFEL_MERGED : 1);
}

/* Returns half the extent of the disc in depth. */
static inline double trip_surfel_extent(const trip_camera *c, const trip_gaussian *g, int normal,
                                        trip_vec3 deviations)
{
    trip_vec3 along = trip_vec3_times(trip_gaussian_to_axes(g, c->forward), deviations);
    if (normal == 0)
        along.x = 0;
    else if (normal == 1)
        along.y = 0;
    else
        along.z = 0;
    return TRIP_SURFEL_WIDEN * TRIP_SURFEL_RADIUS * trip_length(along);
}

/* Returns the width of a pixel at a depth, in units of depth. */
static inline double trip_surfel_pixel_width(const trip_camera *c, double z)
{
    return (c->ortho ? 1 : z) * trip_length(c->rx) * trip_length(c->forward);
}

/* Sets how the depth varies over the disc. Discs seen edge-on have one depth. */
static inline void trip_surfel_set_plane(const trip_camera *c, trip_vec3 normal, trip_vec3 from_eye,
                                         double extent, trip_surfel_footprint *f)
{
    const trip_vec3 ray = c->ortho ? c->r0 : from_eye;
    const double facing = trip_dot(normal, ray);
    f->base = c->ortho ? f->z : 1 / f->z;
    f->slope_x = f->slope_y = 0;
    if (fabs(facing) > 1e-9 * trip_length(ray)) {
        const double by = c->ortho ? -1 / facing : 1 / facing;
        f->slope_x = by * trip_dot(normal, c->rx);
        f->slope_y = by * trip_dot(normal, c->ry);
    }
    const double steepness =
        sqrt(f->slope_x * f->slope_x + f->slope_y * f->slope_y) * (c->ortho ? 1 : f->z * f->z);
    const double most = TRIP_SURFEL_STEEP * trip_surfel_pixel_width(c, f->z);
    extent = fmax(extent, fmin(steepness, most));
    f->near = fmax(0, f->z - extent);
    f->far = f->z + extent;
}

/* Returns the ellipse of a covariance with its determinant. */
static inline trip_surfel_ellipse trip_surfel_ellipse_of(double xy, double yy, double determinant)
{
    return (trip_surfel_ellipse){ sqrt(yy / determinant), xy / yy, 1 / sqrt(yy) };
}

/* Sets the ellipses and the mass. Returns false if the larger one does not reach the picture. */
static inline bool trip_surfel_set_ellipses(const trip_camera *c, const trip_gaussian *g,
                                            trip_vec3 deviations, double opacity,
                                            trip_surfel_footprint *f)
{
    const trip_gaussian_footprint at = { .x = f->x, .y = f->y, .z = f->z };
    trip_vec3 jx, jy;
    trip_gaussian_jacobian(c, TRIP_GAUSSIAN_PROJECTED, &at, &jx, &jy);
    const trip_vec3 a = trip_vec3_times(trip_gaussian_to_axes(g, jx), deviations);
    const trip_vec3 b = trip_vec3_times(trip_gaussian_to_axes(g, jy), deviations);
    const double xx = trip_dot(a, a), xy = trip_dot(a, b), yy = trip_dot(b, b);
    const double bare = trip_dot(trip_cross(a, b), trip_cross(a, b)), add = TRIP_SURFEL_LOW_PASS;
    const double filtered = bare + add * (xx + yy) + add * add;
    const double widen = TRIP_SURFEL_WIDEN * TRIP_SURFEL_WIDEN, more = TRIP_SURFEL_DISC_PASS;
    const double disc = widen * widen * bare + more * widen * (xx + yy) + more * more;
    f->blend = trip_surfel_ellipse_of(xy, yy + add, filtered);
    f->disc = trip_surfel_ellipse_of(widen * xy, widen * yy + more, disc);
    f->mass = opacity * fmax(TRIP_SURFEL_MASS_MIN, sqrt(bare / filtered));
    f->reach_x = sqrt(TRIP_SURFEL_REACH * (xx + add));
    f->reach_y = sqrt(TRIP_SURFEL_REACH * (yy + add));
    return f->reach_x < TRIP_GAUSSIAN_REACH_MAX && f->reach_y < TRIP_GAUSSIAN_REACH_MAX &&
           f->x + f->reach_x >= 0 && f->x - f->reach_x <= c->width && f->y + f->reach_y >= 0 &&
           f->y - f->reach_y <= c->height;
}

/* Returns the squared radius at d = (dx, dy) from the centre. */
static inline double trip_surfel_radius2(const trip_surfel_ellipse *e, double dx, double dy)
{
    const double u = e->across * (dx - e->shear * dy), v = e->down * dy;
    return u * u + v * v;
}

/* Returns z(p) at d = (dx, dy) from the centre. */
static inline double trip_surfel_depth(const trip_surfel_footprint *f, bool ortho, double dx,
                                       double dy)
{
    const double v = f->base + f->slope_x * dx + f->slope_y * dy;
    const double z = ortho ? v : v > 0 ? 1 / v : INFINITY;
    return fmax(f->near, fmin(f->far, z));
}

/* Returns whether a surfel shows its back. */
static inline bool trip_surfel_faces_away(const trip_camera *c, const trip_gaussian *g,
                                          trip_vec3 from_eye)
{
    return !g->two_sided && trip_dot(trip_surfel_normal(g), c->ortho ? c->r0 : from_eye) > 0;
}

/* Computes the footprint of a surfel. Returns false if the surfel is not drawn. */
static inline bool trip_surfel_footprint_of(const trip_camera *c, const trip_gaussian_settings *s,
                                            const trip_gaussian *g, trip_surfel_footprint *f)
{
    const trip_vec3 centre = trip_v3(g->centre[0], g->centre[1], g->centre[2]);
    const trip_vec3 from_eye = trip_sub(centre, c->eye);
    const trip_vec3 deviations = trip_surfel_deviations(g);
    const double unit = TRIP_SURFEL_RADIUS * trip_length(c->forward);
    const double radius = unit * fmax(deviations.x, fmax(deviations.y, deviations.z));
    f->z = trip_dot(c->forward, from_eye);
    if (!(f->z > (c->ortho ? 0 : radius)))
        return false;
    for (int i = 0; i < s->clip.count; i++)
        if (!(trip_dot(s->clip.planes[i].normal, centre) + s->clip.planes[i].offset >= 0))
            return false;
    if (s->front && trip_surfel_faces_away(c, g, from_eye))
        return false;
    const double by = c->ortho ? 1 : f->z;
    f->x = trip_dot(c->to_x, from_eye) / by;
    f->y = trip_dot(c->to_y, from_eye) / by;
    if (!trip_surfel_set_ellipses(c, g, deviations, (double)g->opacity, f))
        return false;
    const int normal = trip_surfel_axis(g);
    trip_surfel_set_plane(c, trip_surfel_principal(g, normal), from_eye,
                          trip_surfel_extent(c, g, normal, deviations), f);
    const bool inside = f->x >= 0 && f->x < c->width && f->y >= 0 && f->y < c->height;
    const double at =
        inside ? trip_surfel_depth(f, c->ortho, floor(f->x) + 0.5 - f->x, floor(f->y) + 0.5 - f->y)
               : f->z;
    f->tolerance = TRIP_SURFEL_OFFSET * radius + trip_surfel_pixel_width(c, f->z);
    f->front = fmax(0, at - f->tolerance);
    return true;
}

/* Returns the coverage by the disc at d = (dx, dy) from the centre. */
static inline double trip_surfel_coverage(const trip_surfel_ellipse *e, double dx, double dy)
{
    const double u = e->across * (dx - e->shear * dy), v = e->down * dy;
    const double gx = e->across * u, gy = e->down * v - e->across * e->shear * u;
    const double q = u * u + v * v, slope = sqrt(gx * gx + gy * gy), rim = TRIP_SURFEL_RIM;
    if (!(slope > 0))
        return fmin(1, sqrt(rim) / e->across);
    return fmax(0, fmin(1, (sqrt(q * rim) - q) / slope));
}

/* Returns the weight at the squared radius q <= TRIP_SURFEL_REACH. */
static inline double trip_surfel_weight(const trip_surfel_footprint *f, double q)
{
    const double rest = 1 - q / TRIP_SURFEL_REACH;
    return f->mass * rest * rest * rest * rest;
}

#endif
