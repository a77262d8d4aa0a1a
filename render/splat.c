#include "splat.h"

#include "report.h"

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
        .low_pass2 = TRIP_LOW_PASS_PX * TRIP_LOW_PASS_PX,
        .amplitude = 1 / (two_pi * sigma * sigma) / (1 - edge * (1 + cutoff2 / 2)),
        .edge = edge,
        .rxrx = trip_dot(camera->rx, camera->rx),
        .rxry = trip_dot(camera->rx, camera->ry),
        .ryry = trip_dot(camera->ry, camera->ry),
    };
}

/* Centre, depth and ray2; the ray through the centre and `c`, the vector whose cross products with
 * rx and ry are A and B. */
static bool place(const trip_splat_frame *f, trip_vec3 voxel, trip_splat *s, trip_vec3 *ray,
                  trip_vec3 *c)
{
    const trip_camera *camera = &f->camera;
    trip_vec3 v = trip_sub(voxel, camera->eye);
    s->z = trip_dot(camera->forward, v);
    if (!(s->z > 0))
        return false;
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
    return true;
}

/* S, S', amplitude and the radius: the rays of {q : g q^T S'^-1 q <= k^2} lie within
 * sigma k sqrt(largest eigenvalue of S^-1 S') of the centre, and S^-1 S' = I + low_pass2 S^-1. */
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

/* False unless the support is an ellipse. */
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

bool trip_splat_project(const trip_splat_frame *f, trip_vec3 voxel, trip_splat *out)
{
    trip_vec3 ray, c;
    if (!place(f, voxel, out, &ray, &c))
        return false;
    set_footprint(f, ray, c, out);
    return set_bounds(f, ray, out);
}

/* Voxels in front of the eye. So near the plane of the eye every support crosses it and is no
 * ellipse, whatever divides by what rounding left of 0. */
static const double nearest = 1e-6;

bool trip_splat_is_broken(const trip_splat *s)
{
    if (s->z <= nearest)
        return false;
    return !isfinite(s->x + s->y + s->conic_xx + s->conic_xy + s->conic_yy + s->amplitude);
}

int trip_splat_fail(void)
{
    return trip_fail(TRIP_ERROR, "render", "projection",
                     "numbers are not finite; the view or the grid is out of any range");
}

double trip_splat_radius2(const trip_splat_frame *f, const trip_splat *s, double x, double y)
{
    double dx = x - s->x, dy = y - s->y;
    double q = s->conic_xx * dx * dx + 2 * s->conic_xy * dx * dy + s->conic_yy * dy * dy;
    if (f->camera.ortho)
        return q;
    trip_vec3 ray = trip_camera_ray(&f->camera, x, y);
    return q * s->ray2 / trip_dot(ray, ray);
}

double trip_splat_stretch(const trip_splat_frame *f, double x, double y)
{
    return trip_camera_ray_length(&f->camera, x, y) /
           trip_length(trip_camera_ray(&f->camera, x, y));
}

/* The footprints of all voxels of a sheet at a place in a cell. */
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
