#include "splat.h"

#include "ewa.h"
#include "report.h"

/* Returns the variance of the low-pass filter in pixels. Let L be the largest eigenvalue of the
 * matrix of rx and ry. A ray of the filter's support differs from r_c by at most k |q| sqrt(L).
 * |r_c| |forward| is at least 1. */
static double low_pass2_of(const trip_camera *c, const trip_settings *settings)
{
    const double px = trip_settings_low_pass_px(settings), px2 = px * px;
    if (c->ortho)
        return px2;
    const double xx = trip_dot(c->rx, c->rx), yy = trip_dot(c->ry, c->ry);
    const double largest = (xx + yy) / 2 + hypot((xx - yy) / 2, trip_dot(c->rx, c->ry));
    const double apart2 =
        TRIP_CUTOFF * TRIP_CUTOFF * largest * trip_dot(c->forward, c->forward); /* of one pixel */
    return fmin(px2, TRIP_SPLAT_AFFINE * TRIP_SPLAT_AFFINE / apart2);
}

trip_splat_frame trip_splat_frame_make(const trip_camera *camera, const trip_settings *settings)
{
    double sigma = settings->kernel_radius / TRIP_CUTOFF;
    double cutoff2 = TRIP_CUTOFF * TRIP_CUTOFF;
    double two_pi = 6.28318530717958647692;
    double edge = exp(-cutoff2 / 2);
    return (trip_splat_frame){
        .camera = *camera,
        .sigma = sigma,
        .cutoff2 = cutoff2,
        .affine = settings->footprint == TRIP_FOOTPRINT_EWA && !camera->ortho,
        .low_pass = settings->low_pass,
        .fixed = settings->footprint == TRIP_FOOTPRINT_FIXED
                     ? settings->sprite_px / (2 * TRIP_CUTOFF)
                     : 0,
        .flatten = settings->flatten > 1 ? 1 - 1 / (settings->flatten * settings->flatten) : 0,
        .low_pass2 = low_pass2_of(camera, settings),
        .amplitude = 1 / (two_pi * sigma * sigma) / (1 - edge * (1 + cutoff2 / 2)),
        .edge = edge,
        .rxrx = trip_dot(camera->rx, camera->rx),
        .rxry = trip_dot(camera->rx, camera->ry),
        .ryry = trip_dot(camera->ry, camera->ry),
        .front = 1 / erf(sqrt(0.5 * cutoff2)),
    };
}

trip_splat_frame trip_splat_frame_scaled(const trip_splat_frame *f, trip_vec3 unit)
{
    trip_splat_frame out = *f;
    trip_camera *c = &out.camera;
    c->eye = trip_vec3_over(c->eye, unit);
    c->r0 = trip_vec3_over(c->r0, unit);
    c->rx = trip_vec3_over(c->rx, unit);
    c->ry = trip_vec3_over(c->ry, unit);
    c->forward = trip_vec3_times(c->forward, unit);
    c->to_x = trip_vec3_times(c->to_x, unit);
    c->to_y = trip_vec3_times(c->to_y, unit);
    for (int row = 0; row < 3; row++)
        for (int a = 0; a < 3; a++)
            c->index_to_world.m[row][a] *= trip_component(unit, a);
    out.rxrx = trip_dot(c->rx, c->rx);
    out.rxry = trip_dot(c->rx, c->ry);
    out.ryry = trip_dot(c->ry, c->ry);
    return out;
}

trip_vec3 trip_splat_position(const trip_splat_frame *f, const trip_coordinates *coordinates,
                              trip_vec3 voxel, trip_splat_frame *frame, double *growth)
{
    *growth = 1;
    if (!trip_coordinates_uneven(coordinates)) {
        *frame = *f;
        return voxel;
    }
    const trip_vec3 width = trip_coordinates_widths(coordinates, voxel);
    *frame = trip_splat_frame_scaled(f, width);
    *growth = fmax(width.x, fmax(width.y, width.z));
    return trip_vec3_over(trip_coordinates_point(coordinates, voxel), width);
}

/* Computes centre and ray2 of a splat at a depth. Returns the ray through the centre, and `c`, the
 * vector with the cross products A and B with rx and ry. */
static void position(const trip_splat_frame *f, trip_vec3 v, trip_splat *s, trip_vec3 *ray,
                     trip_vec3 *c)
{
    const trip_camera *camera = &f->camera;
    if (camera->ortho) {
        s->x = trip_dot(camera->to_x, v);
        s->y = trip_dot(camera->to_y, v);
        *ray = *c = camera->r0;
        s->ray2 = 1;
    } else {
        s->x = trip_dot(camera->to_x, v) / s->z;
        s->y = trip_dot(camera->to_y, v) / s->z;
        *ray = trip_scale(v, 1 / s->z);
        *c = v;
        s->ray2 = trip_dot(*ray, *ray);
    }
}

/* Sets S', amplitude and radius. The rays of {q : g q^T S'^-1 q <= k^2} lie within sigma k
 * sqrt(largest eigenvalue of S^-1 S') of the centre, and S^-1 S' = I + low_pass2 S^-1. */
static void set_footprint(const trip_splat_frame *f, trip_vec3 ray, trip_vec3 c, trip_splat *s)
{
    trip_vec3 a = trip_cross(c, f->camera.rx), b = trip_cross(c, f->camera.ry);
    double scale = 1 / (f->sigma * f->sigma * trip_dot(ray, ray));
    double ixx = trip_dot(a, a) * scale, ixy = trip_dot(a, b) * scale; /* S^-1 */
    double iyy = trip_dot(b, b) * scale;
    double inverse_det = trip_dot(trip_cross(a, b), trip_cross(a, b)) * scale * scale;

    double sxx = iyy / inverse_det + f->low_pass2; /* S' */
    double syy = ixx / inverse_det + f->low_pass2;
    double sxy = -ixy / inverse_det;
    /* |S'| = |S| + low_pass2 trace S + low_pass2^2, without the cancellation of xx yy - xy^2. */
    double det = (1 + f->low_pass2 * (ixx + iyy)) / inverse_det + f->low_pass2 * f->low_pass2;
    s->conic_xx = syy / det;
    s->conic_yy = sxx / det;
    s->conic_xy = -sxy / det;
    s->amplitude = f->amplitude * sqrt(1 / (inverse_det * det));

    double mean = 0.5 * (ixx + iyy);
    double largest = mean + hypot(0.5 * (ixx - iyy), ixy);
    s->radius = f->sigma * sqrt(f->cutoff2 * (1 + f->low_pass2 * largest));
}

/* Sets the bounds of the support. Returns false if it is no ellipse. */
static bool set_bounds(const trip_splat_frame *f, trip_vec3 ray, trip_splat *s)
{
    double k2 = f->cutoff2;
    double exx = s->conic_xx, exy = s->conic_xy, eyy = s->conic_yy, lx = 0, ly = 0;
    if (!f->camera.ortho) {
        double t = k2 / s->ray2;
        exx -= t * f->rxrx;
        exy -= t * f->rxry;
        eyy -= t * f->ryry;
        lx = t * trip_dot(ray, f->camera.rx);
        ly = t * trip_dot(ray, f->camera.ry);
    }
    double det = exx * eyy - exy * exy;
    if (!(exx > 0 && det > 0))
        return false;
    double cx = (eyy * lx - exy * ly) / det, cy = (exx * ly - exy * lx) / det;
    double size = k2 + lx * cx + ly * cy;
    double half_x = sqrt(size * eyy / det), half_y = sqrt(size * exx / det);
    s->x0 = s->x + cx - half_x;
    s->x1 = s->x + cx + half_x;
    s->y0 = s->y + cy - half_y;
    s->y1 = s->y + cy + half_y;
    return true;
}

static trip_covariance2 low_passed(const trip_splat_frame *f, const trip_covariance2 *s)
{
    return f->low_pass == TRIP_LOW_PASS_UNIFORM ? trip_covariance2_scaled(s, f->low_pass2)
                                                : trip_covariance2_low_passed(s, f->low_pass2);
}

/* Sets conic, amplitude (without stretch), bounds and radius of a fixed footprint. z is 1 in
 * parallel views. */
static void set_fixed(const trip_splat_frame *f, double z, trip_splat *s)
{
    double exact2 = f->fixed * f->fixed, wide2 = exact2 + f->low_pass2;
    double reach = sqrt(f->cutoff2 * wide2);
    s->conic_xx = s->conic_yy = 1 / wide2;
    s->conic_xy = 0;
    s->amplitude = f->amplitude * (exact2 / wide2);
    s->x0 = s->x - reach;
    s->x1 = s->x + reach;
    s->y0 = s->y - reach;
    s->y1 = s->y + reach;
    s->radius = z * reach * sqrt(f->rxrx + f->ryry);
}

double trip_splat_fixed_radius_px(const trip_settings *settings)
{
    return hypot(settings->sprite_px / 2, TRIP_CUTOFF * trip_settings_low_pass_px(settings));
}

/* Returns the cosine of the angle between the axis of view and the ray through a point; 1 in
 * parallel views. */
static double cosine_off_axis(const trip_camera *camera, trip_vec3 from_eye)
{
    trip_vec3 way = trip_affine_vector(&camera->index_to_world, from_eye);
    return camera->ortho ? 1 : trip_dot(camera->world_forward, trip_normalize(way));
}

/* The projection scales lengths across the ray by |v'c - E| / |vc - E|. The slanted plane of the
 * picture makes them longer by one over the cosine. The paper has no such factor, so it is removed
 * here. */
double trip_splat_sprite_px(const trip_camera *camera, const trip_settings *settings,
                            trip_vec3 middle)
{
    trip_covariance kernel = trip_covariance_round(settings->kernel_radius / TRIP_CUTOFF);
    trip_vec3 from_eye = trip_sub(middle, camera->eye);
    if (!camera->ortho && !(trip_dot(camera->forward, from_eye) > 0))
        return 0;
    trip_ray_space j = trip_ray_space_at(camera, from_eye);
    double area = sqrt(trip_covariance_integrated(&kernel, &j).det);
    return 2 * TRIP_CUTOFF * sqrt(area * cosine_off_axis(camera, from_eye));
}

/* Projects a fixed footprint in perspective. Returns false behind the eye, and so near the eye that
 * the position in the picture is not finite. */
static bool project_fixed(const trip_splat_frame *f, trip_vec3 v, trip_splat *s)
{
    const double farthest_px = 1e9;
    trip_vec3 ray, c;
    if (!(s->z > 0))
        return false;
    position(f, v, s, &ray, &c);
    if (!(fabs(s->x) < farthest_px && fabs(s->y) < farthest_px))
        return *s = (trip_splat){ .z = s->z }, false;
    set_fixed(f, s->z, s);
    s->affine = true;
    s->ray2 = 1;
    s->amplitude *= trip_splat_stretch(f, s->x, s->y);
    return true;
}

/* Whether the rays of the round kernel's support are close enough to r_c. */
static bool is_affine(const trip_splat_frame *f, trip_vec3 ray, const trip_ray_space *j)
{
    trip_covariance kernel = trip_covariance_round(f->sigma);
    trip_covariance2 s = trip_covariance_integrated(&kernel, j), wide = low_passed(f, &s);
    double apart2 = f->cutoff2 * (wide.xx * f->rxrx + 2 * wide.xy * f->rxry + wide.yy * f->ryry);
    return TRIP_SPLAT_AFFINE * TRIP_SPLAT_AFFINE * trip_dot(ray, ray) >= apart2;
}

/* Returns the radius of a flat kernel after Swan's scaling, which may be many times the round
 * kernel's. S' lies within the round kernel's S times the scale. No ray r of the view's plane has
 * |r_c| / |r| above |r_c| |forward|. */
static double scaled_radius(const trip_splat_frame *f, const trip_covariance2 *exact,
                            const trip_covariance2 *wide, double ray2)
{
    double scale = sqrt(wide->det / exact->det);
    double slant2 = f->camera.ortho ? 1 : ray2 * trip_dot(f->camera.forward, f->camera.forward);
    return f->sigma * sqrt(f->cutoff2 * scale * slant2);
}

/* Sets conic, amplitude and bounds by the affine approximation; the centre is already set. Sets the
 * radius if it differs from the round kernel's. */
static void set_affine(const trip_splat_frame *f, const trip_ray_space *j,
                       const trip_flattening *flat, trip_splat *s)
{
    trip_covariance kernel = trip_covariance_flattened(f->sigma, flat->normal, flat->share);
    trip_covariance2 exact = trip_covariance_integrated(&kernel, j);
    trip_covariance2 wide = low_passed(f, &exact), conic = trip_covariance2_inverse(&wide);
    double half_x = sqrt(f->cutoff2 * wide.xx), half_y = sqrt(f->cutoff2 * wide.yy);
    if (f->low_pass == TRIP_LOW_PASS_UNIFORM && flat->share > 0)
        s->radius = scaled_radius(f, &exact, &wide, s->ray2);
    s->affine = true;
    s->ray2 = 1;
    s->conic_xx = conic.xx;
    s->conic_xy = conic.xy;
    s->conic_yy = conic.yy;
    s->amplitude = f->amplitude * f->sigma * f->sigma * trip_ray_space_volume(j) / sqrt(wide.det);
    s->x0 = s->x - half_x;
    s->x1 = s->x + half_x;
    s->y0 = s->y - half_y;
    s->y1 = s->y + half_y;
}

/* Projects a splat in perspective by the affine approximation. Returns false if it does not apply.
 */
static bool project_affine(const trip_splat_frame *f, trip_vec3 v, const trip_flattening *flat,
                           trip_splat *s)
{
    trip_vec3 ray, c;
    position(f, v, s, &ray, &c);
    trip_ray_space j = trip_ray_space_at(&f->camera, v);
    if (!is_affine(f, ray, &j))
        return false;
    set_footprint(f, ray, c, s); /* only its radius is kept */
    s->radius *= TRIP_SPLAT_AFFINE_REACH;
    set_affine(f, &j, flat, s);
    return true;
}

/* Sets two unit vectors at right angles to v and to one another. Any two will do if v is zero. */
static void set_across(trip_vec3 v, trip_vec3 e[2])
{
    double x = fabs(v.x), y = fabs(v.y), z = fabs(v.z);
    trip_vec3 other = trip_v3(x <= y && x <= z, y < x && y <= z, z < x && z < y);
    if (!(trip_length(v) > 0))
        v = trip_v3(1, 0, 0), other = trip_v3(0, 1, 0);
    e[0] = trip_normalize(trip_cross(v, other));
    e[1] = trip_normalize(trip_cross(v, e[0]));
}

/* Sets a linear form of a pixel position (x, y): e . (r0 + x rx + y ry) times `scale`. */
static void set_form(double form[3], trip_vec3 e, trip_vec3 r0, trip_vec3 rx, trip_vec3 ry,
                     double scale)
{
    form[0] = scale * trip_dot(e, r0);
    form[1] = scale * trip_dot(e, rx);
    form[2] = scale * trip_dot(e, ry);
}

/* Sets a, b, amplitude and radius from the factor of W^-1 with a zero in the lower left. rho of a
 * pixel (px, py) is taken of origin + px x + py y. */
static void set_across_forms(const trip_splat_frame *f, const trip_vec3 e[2], trip_vec3 origin,
                             trip_vec3 x, trip_vec3 y, double scale, double low_pass2,
                             trip_splat *s)
{
    double x0 = trip_dot(e[0], x), x1 = trip_dot(e[1], x);
    double y0 = trip_dot(e[0], y), y1 = trip_dot(e[1], y);
    double w00 = 1 + low_pass2 * (x0 * x0 + y0 * y0), w01 = low_pass2 * (x0 * x1 + y0 * y1);
    double w11 = 1 + low_pass2 * (x1 * x1 + y1 * y1), cross = low_pass2 * (x0 * y1 - x1 * y0);
    /* |W|, without the cancellation of w00 w11 - w01^2. */
    double det = w00 + w11 - 1 + cross * cross;
    double along = sqrt(w11 / det);
    set_form(s->b, e[1], origin, x, y, scale / sqrt(w11));
    set_form(s->a, trip_sub(e[0], trip_scale(e[1], w01 / w11)), origin, x, y, scale * along);
    s->amplitude = f->amplitude / sqrt(det);
    double mean = 0.5 * (w00 + w11);
    s->radius = f->sigma * sqrt(f->cutoff2 * (mean + hypot(0.5 * (w00 - w11), w01)));
}

/* Finds the minimum and maximum p of [0, size] with (X - p z)^2 <= reach^2 |to - p forward|^2, X =
 * to . c. The rays of column or row p form a plane; it passes within `reach` of c. Returns false if
 * no p does. */
static bool bound_along(const trip_splat_frame *f, trip_vec3 to, trip_vec3 c, double z,
                        double reach, int size, double *lo, double *hi)
{
    trip_vec3 forward = f->camera.forward;
    double x = trip_dot(to, c), r2 = reach * reach;
    double q2 = z * z - r2 * trip_dot(forward, forward);
    double q1 = x * z - r2 * trip_dot(to, forward);
    double q0 = x * x - r2 * trip_dot(to, to);
    /* Solves q2 p^2 - 2 q1 p + q0 <= 0, with q1^2 - q2 q0 free of cancellation. */
    trip_vec3 across = trip_sub(trip_scale(to, z), trip_scale(forward, x));
    trip_vec3 normal = trip_cross(to, forward);
    double root = r2 * (trip_dot(across, across) - r2 * trip_dot(normal, normal));
    bool lowest = q0 <= 0, highest = (q2 * size - 2 * q1) * size + q0 <= 0;
    *lo = 0;
    *hi = size;
    if ((lowest && highest) || !(root >= 0))
        return lowest || highest || q2 <= 0 || !isfinite(root);
    double half = q1 + copysign(sqrt(root), q1), roots[2] = { q0 / half, half / q2 };
    if (half == 0)
        return true;
    double first = fmin(roots[0], roots[1]), last = fmax(roots[0], roots[1]);
    if (!lowest)
        *lo = first > 0 ? first : last;
    if (!highest)
        *hi = last < size ? last : first;
    return *lo <= size && *hi >= 0 && *lo <= *hi;
}

double trip_splat_behind(const trip_splat_frame *f)
{
    return sqrt(2 * f->cutoff2) * f->sigma * trip_length(f->camera.forward);
}

/* Sets a splat in perspective by the formulas of near splats. */
static bool set_near(const trip_splat_frame *f, trip_vec3 c, trip_splat *s)
{
    const trip_camera *camera = &f->camera;
    double length = trip_length(c), front = fmax(s->z, 0) / f->sigma;
    trip_vec3 e[2];
    *s = (trip_splat){ .z = s->z, .near = true };
    set_across(c, e);
    set_across_forms(f, e, camera->r0, camera->rx, camera->ry, length / f->sigma,
                     f->low_pass2 * front * front, s);
    set_form(s->along, c, camera->r0, camera->rx, camera->ry, 1 / f->sigma);
    bool seen = bound_along(f, camera->to_x, c, s->z, s->radius, camera->width, &s->x0, &s->x1) &&
                bound_along(f, camera->to_y, c, s->z, s->radius, camera->height, &s->y0, &s->y1);
    s->radius = INFINITY;
    return seen && !(s->z < -trip_splat_behind(f));
}

/* Returns the maximum difference of s over the support from its value at the centre. */
static double slant(const trip_splat_frame *f, const trip_splat *s)
{
    double scale = 1 / (trip_length(f->camera.r0) * f->sigma);
    return 0.5 * scale *
           (fabs(trip_dot(f->camera.r0, f->camera.rx)) * (s->x1 - s->x0) +
            fabs(trip_dot(f->camera.r0, f->camera.ry)) * (s->y1 - s->y0));
}

static void set_parallel_footprint(const trip_splat_frame *f, trip_vec3 ray, trip_vec3 c,
                                   trip_splat *s)
{
    set_footprint(f, ray, c, s);
    if (f->fixed > 0)
        set_fixed(f, 1, s);
    else
        set_bounds(f, ray, s);
}

double trip_splat_parallel_near(const trip_splat_frame *f)
{
    trip_splat s = { .z = 1 };
    trip_vec3 ray, c;
    position(f, f->camera.r0, &s, &ray, &c);
    set_parallel_footprint(f, ray, c, &s);
    return (sqrt(f->cutoff2) + slant(f, &s)) * f->sigma / trip_length(f->camera.r0);
}

static bool project_parallel(const trip_splat_frame *f, trip_vec3 v, const trip_flattening *flat,
                             trip_splat *s)
{
    trip_vec3 ray, c;
    position(f, v, s, &ray, &c);
    set_parallel_footprint(f, ray, c, s);
    double unit = f->sigma / trip_length(f->camera.r0);
    double reach = (sqrt(f->cutoff2) + slant(f, s)) * unit;
    s->near = !(s->z >= reach);
    set_form(s->along, f->camera.r0, v, trip_scale(f->camera.rx, -1), trip_scale(f->camera.ry, -1),
             1 / (trip_length(f->camera.r0) * f->sigma));
    if (flat->share > 0 || f->low_pass == TRIP_LOW_PASS_UNIFORM) {
        trip_ray_space j = trip_ray_space_at(&f->camera, v);
        set_affine(f, &j, flat, s);
    }
    return !(s->z <= -reach);
}

trip_flattening trip_splat_flattening(const trip_splat_frame *f, const double gradient[3],
                                      double gradient_full)
{
    trip_vec3 g = { gradient[0], gradient[1], gradient[2] };
    trip_vec3 normal = trip_affine_transpose_vector(&f->camera.index_to_world, g);
    return (trip_flattening){ trip_normalize(normal),
                              f->flatten * fmin(1, trip_length(g) / gradient_full) };
}

bool trip_splat_project(const trip_splat_frame *f, trip_vec3 voxel, trip_splat *out)
{
    return trip_splat_project_flat(f, voxel, &(trip_flattening){ 0 }, out);
}

bool trip_splat_project_flat(const trip_splat_frame *f, trip_vec3 voxel,
                             const trip_flattening *flat, trip_splat *out)
{
    trip_vec3 ray, c, v = trip_sub(voxel, f->camera.eye);
    *out = (trip_splat){ .z = trip_dot(f->camera.forward, v) };
    if (f->camera.ortho)
        return project_parallel(f, v, flat, out);
    if (f->fixed > 0)
        return project_fixed(f, v, out);
    if (f->affine)
        return (out->z > 0 && project_affine(f, v, flat, out)) || set_near(f, v, out);
    if (out->z > 0) {
        position(f, v, out, &ray, &c);
        set_footprint(f, ray, c, out);
        double kernel2 = f->cutoff2 * f->sigma * f->sigma;
        bool ellipse = set_bounds(f, ray, out);
        if (ellipse && trip_dot(v, v) >= kernel2 + out->radius * out->radius)
            return true;
    }
    return set_near(f, v, out);
}

bool trip_splat_project_near(const trip_splat_frame *f, trip_vec3 voxel, trip_splat *out)
{
    const trip_vec3 v = trip_sub(voxel, f->camera.eye);
    *out = (trip_splat){ .z = trip_dot(f->camera.forward, v) };
    return set_near(f, v, out);
}

bool trip_splat_is_broken(const trip_splat *s)
{
    double sum = s->amplitude;
    if (s->near)
        for (int i = 0; i < 3; i++)
            sum += s->a[i] + s->b[i] + s->along[i];
    else
        sum += s->x + s->y + s->conic_xx + s->conic_xy + s->conic_yy;
    return !isfinite(sum);
}

int trip_splat_fail(void)
{
    return trip_fail(TRIP_ERROR, "render", "projection",
                     "a splat's numbers are not finite; the view or the grid is out of range");
}

static double form_at(const double form[3], double x, double y)
{
    return form[0] + form[1] * x + form[2] * y;
}

/* Returns s(p) of a near splat. */
static double distance_along(const trip_splat_frame *f, const trip_splat *s, double x, double y)
{
    double along = form_at(s->along, x, y);
    return f->camera.ortho ? along : along / trip_length(trip_camera_ray(&f->camera, x, y));
}

double trip_splat_front(const trip_splat_frame *f, const trip_splat *s, double x, double y)
{
    if (!s->near)
        return 1;
    double t = distance_along(f, s, x, y) * sqrt(0.5), end = sqrt(0.5 * f->cutoff2);
    return t >= end ? 1 : t <= -end ? 0 : 0.5 + 0.5 * f->front * erf(t);
}

/* Returns m(p), without regard to the position of the eye. */
static double radius2(const trip_splat_frame *f, const trip_splat *s, double x, double y)
{
    double dx = x - s->x, dy = y - s->y;
    double q = s->conic_xx * dx * dx + 2 * s->conic_xy * dx * dy + s->conic_yy * dy * dy;
    if (f->camera.ortho || s->affine)
        return q;
    trip_vec3 ray = trip_camera_ray(&f->camera, x, y);
    double a = form_at(s->a, x, y), b = form_at(s->b, x, y);
    return (s->near ? a * a + b * b : q * s->ray2) / trip_dot(ray, ray);
}

double trip_splat_radius2(const trip_splat_frame *f, const trip_splat *s, double x, double y)
{
    return trip_splat_front(f, s, x, y) > 0 ? radius2(f, s, x, y) : INFINITY;
}

double trip_splat_stretch(const trip_splat_frame *f, double x, double y)
{
    return trip_camera_ray_length(&f->camera, x, y) /
           trip_length(trip_camera_ray(&f->camera, x, y));
}

/* Returns the sum of the footprints of all voxels of a sheet at (u, v) in a cell. */
static double sum_of_footprints(const trip_splat_frame *f, double kernel_radius, double u, double v)
{
    int reach = (int)kernel_radius + 1;
    double sum = 0;
    for (int i = -reach; i <= reach; i++)
        for (int j = -reach; j <= reach; j++) {
            double m = ((i - u) * (i - u) + (j - v) * (j - v)) / (f->sigma * f->sigma);
            sum += m < f->cutoff2 ? f->amplitude * (exp(-m / 2) - f->edge) : 0;
        }
    return sum;
}

trip_splat_ripple trip_splat_ripple_of(double kernel_radius)
{
    trip_settings settings = { .kernel_radius = kernel_radius };
    trip_splat_frame f = trip_splat_frame_make(&(trip_camera){ 0 }, &settings);
    return (trip_splat_ripple){ sum_of_footprints(&f, kernel_radius, 0, 0),
                                sum_of_footprints(&f, kernel_radius, 0.5, 0.5) };
}
