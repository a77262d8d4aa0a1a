#include "navigation.h"

#include <stdio.h>
#include <string.h>

#include "geometry.h"
#include "text.h"

#define DEGREE (3.14159265358979323846 / 180)

static trip_vec3 vector(const double v[3])
{
    return trip_v3(v[0], v[1], v[2]);
}

static void put(double out[3], trip_vec3 v)
{
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

/* Working copy of a change. apply() writes it back if it is a valid view. */
typedef struct pose {
    trip_vec3 eye, look, right, up, forward; /* the last three have unit length */
    double distance;
} pose;

static pose pose_of(const trip_navigation *n)
{
    pose p = { .eye = vector(n->eye), .look = vector(n->look) };
    trip_vec3 view_direction = trip_sub(p.look, p.eye);
    p.distance = trip_length(view_direction);
    p.forward = trip_normalize(view_direction);
    p.right = trip_normalize(trip_cross(p.forward, vector(n->up)));
    p.up = trip_cross(p.right, p.forward);
    return p;
}

static bool is_finite(trip_vec3 v)
{
    return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

/* Minimum distance of the eye from the point looked at, relative to their coordinates: below it the
 * view direction is inexact. */
#define NEAREST 1e-9

static void apply(trip_navigation *n, trip_vec3 eye, trip_vec3 look, trip_vec3 up)
{
    double distance = trip_length(trip_sub(look, eye)), size = trip_length(eye) + trip_length(look);
    if (!is_finite(eye) || !is_finite(look) || !is_finite(up) || !isfinite(distance) ||
        !(distance > NEAREST * size))
        return;
    put(n->eye, eye);
    put(n->look, look);
    put(n->up, up);
}

static double tangent(const trip_navigation *n)
{
    return tan(n->fov_degrees / 2 * DEGREE);
}

/* Rotates about an axis of unit length. */
static trip_vec3 turned(trip_vec3 v, trip_vec3 axis, double degrees)
{
    return trip_turned(v, axis, degrees * DEGREE);
}

trip_navigation trip_navigation_from_camera(const triptych_camera *camera, const double *upright)
{
    enum { DEFAULT_FOV = 30 };
    trip_navigation n = { .fov_degrees =
                              camera->fov_degrees > 0 ? camera->fov_degrees : DEFAULT_FOV,
                          .ortho_height = camera->ortho_height };
    memcpy(n.eye, camera->eye, sizeof n.eye);
    memcpy(n.look, camera->look, sizeof n.look);
    memcpy(n.up, camera->up, sizeof n.up);
    put(n.upright, trip_normalize(vector(upright ? upright : camera->up)));
    return n;
}

triptych_view trip_navigation_view(const trip_navigation *n, int width, int height)
{
    return (triptych_view){ .width = width,
                            .height = height,
                            .eye = n->eye,
                            .look = n->look,
                            .up = n->up,
                            .fov_degrees = n->fov_degrees,
                            .ortho_height = n->ortho_height };
}

static const char *triple(const double p[3], char text[128])
{
    char x[32], y[32], z[32];
    snprintf(text, 128, "%s,%s,%s", trip_text_from_double(p[0], x), trip_text_from_double(p[1], y),
             trip_text_from_double(p[2], z));
    return text;
}

char *trip_navigation_options(const trip_navigation *n, int width, int height)
{
    char *options, eye[128], look[128], up[128], number[32];
    bool ortho = n->ortho_height > 0;
    trip_text_from_double(ortho ? n->ortho_height : n->fov_degrees, number);
    if (asprintf(&options, "--eye %s --look %s --up %s --%s %s --size %dx%d", triple(n->eye, eye),
                 triple(n->look, look), triple(n->up, up), ortho ? "ortho" : "fov", number, width,
                 height) < 0)
        return NULL;
    return options;
}

trip_navigation_axes trip_navigation_get_axes(const trip_navigation *n)
{
    pose p = pose_of(n);
    trip_navigation_axes axes;
    put(axes.right, p.right);
    put(axes.up, p.up);
    put(axes.forward, p.forward);
    return axes;
}

double trip_navigation_distance(const trip_navigation *n)
{
    return pose_of(n).distance;
}

double trip_navigation_pixel(const trip_navigation *n, int height, double depth)
{
    return (n->ortho_height > 0 ? n->ortho_height : 2 * tangent(n) * depth) / height;
}

double trip_navigation_project(const trip_navigation *n, int width, int height,
                               const double point[3], double pixel[2])
{
    pose p = pose_of(n);
    trip_vec3 c = trip_sub(vector(point), p.eye);
    double depth = trip_dot(c, p.forward), size = trip_navigation_pixel(n, height, depth);
    pixel[0] = 0.5 * width + trip_dot(c, p.right) / size;
    pixel[1] = 0.5 * height - trip_dot(c, p.up) / size;
    return depth;
}

void trip_navigation_point(const trip_navigation *n, int width, int height, const double pixel[2],
                           double depth, double point[3])
{
    pose p = pose_of(n);
    double size = trip_navigation_pixel(n, height, depth);
    double x = (pixel[0] - 0.5 * width) * size, y = (0.5 * height - pixel[1]) * size;
    put(point, trip_add(trip_add(p.eye, trip_scale(p.forward, depth)),
                        trip_add(trip_scale(p.right, x), trip_scale(p.up, y))));
}

void trip_navigation_orbit(trip_navigation *n, double azimuth_degrees, double elevation_degrees)
{
    pose p = pose_of(n);
    trip_vec3 upright = vector(n->upright);
    double azimuth = trip_dot(p.up, upright) < 0 ? -azimuth_degrees : azimuth_degrees;
    trip_vec3 from = trip_sub(p.eye, p.look);
    from = turned(turned(from, p.right, -elevation_degrees), upright, azimuth);
    trip_vec3 up = turned(turned(p.up, p.right, -elevation_degrees), upright, azimuth);
    apply(n, trip_add(p.look, from), p.look, up);
}

static void shift(trip_navigation *n, trip_vec3 by)
{
    apply(n, trip_add(vector(n->eye), by), trip_add(vector(n->look), by), vector(n->up));
}

void trip_navigation_pan(trip_navigation *n, double dx_px, double dy_px, int height, double depth)
{
    pose p = pose_of(n);
    double size = trip_navigation_pixel(n, height, depth);
    shift(n, trip_add(trip_scale(p.right, -dx_px * size), trip_scale(p.up, dy_px * size)));
}

void trip_navigation_dolly(trip_navigation *n, double factor, const double point[3])
{
    trip_navigation next = *n;
    trip_vec3 to = vector(point), eye = trip_sub(vector(n->eye), to);
    trip_vec3 look = trip_sub(vector(n->look), to);
    if (!(factor > 0 && isfinite(factor)))
        return;
    apply(&next, trip_add(to, trip_scale(eye, factor)), trip_add(to, trip_scale(look, factor)),
          vector(n->up));
    next.ortho_height *= factor;
    bool moved = memcmp(next.eye, n->eye, sizeof n->eye) != 0;
    bool parallel = n->ortho_height > 0;
    if (moved && (!parallel || (next.ortho_height > 1e-100 && next.ortho_height < 1e100)))
        *n = next;
}

void trip_navigation_fly(trip_navigation *n, double forward, double right, double up)
{
    pose p = pose_of(n);
    shift(n, trip_add(trip_scale(p.forward, forward),
                      trip_add(trip_scale(p.right, right), trip_scale(p.up, up))));
}

void trip_navigation_turn(trip_navigation *n, double right_degrees, double up_degrees)
{
    pose p = pose_of(n);
    trip_vec3 upright = vector(n->upright);
    double right = trip_dot(p.up, upright) < 0 ? right_degrees : -right_degrees;
    trip_vec3 view_direction = trip_sub(p.look, p.eye);
    view_direction = turned(turned(view_direction, p.right, up_degrees), upright, right);
    trip_vec3 up = turned(turned(p.up, p.right, up_degrees), upright, right);
    apply(n, p.eye, trip_add(p.eye, view_direction), up);
}

void trip_navigation_roll(trip_navigation *n, double degrees)
{
    pose p = pose_of(n);
    apply(n, p.eye, p.look, turned(p.up, p.forward, -degrees));
}

/* Moves the eye to `distance` from the point looked at. */
static void set_distance(trip_navigation *n, double distance)
{
    pose p = pose_of(n);
    apply(n, trip_sub(p.look, trip_scale(p.forward, distance)), p.look, p.up);
}

void trip_navigation_set_fov(trip_navigation *n, double degrees)
{
    double height = 2 * tangent(n) * trip_navigation_distance(n);
    if (!(degrees >= TRIPTYCH_FOV_MIN_DEGREES && degrees <= TRIPTYCH_FOV_MAX_DEGREES))
        return;
    n->fov_degrees = degrees;
    if (!(n->ortho_height > 0))
        set_distance(n, height / (2 * tangent(n)));
}

void trip_navigation_set_parallel(trip_navigation *n, bool parallel)
{
    if (parallel == (n->ortho_height > 0))
        return;
    double height = n->ortho_height;
    n->ortho_height = parallel ? 2 * tangent(n) * trip_navigation_distance(n) : 0;
    if (!parallel)
        set_distance(n, height / (2 * tangent(n)));
}

void trip_navigation_look_from(trip_navigation *n, const double direction[3])
{
    pose p = pose_of(n);
    trip_vec3 from = trip_normalize(vector(direction)), up = vector(n->upright);
    if (!(trip_length(from) > 0))
        return;
    if (trip_length(trip_cross(from, up)) < 1e-6)
        up = fabs(up.y) < 0.9 ? trip_v3(0, 1, 0) : trip_v3(0, 0, 1);
    apply(n, trip_add(p.look, trip_scale(from, p.distance)), p.look, up);
}

/* Computes the extent of the eight corners along an axis of the camera. Each corner is first moved
 * by `tangent` times its depth. A frustum centred on the result then contains the box. */
static void reach(const trip_vec3 corners[8], trip_vec3 axis, trip_vec3 forward, double slope,
                  double sides[2])
{
    sides[0] = sides[1] = -INFINITY;
    for (int i = 0; i < 8; i++) {
        double across = trip_dot(corners[i], axis), along = trip_dot(corners[i], forward);
        sides[0] = fmax(sides[0], across - slope * along);
        sides[1] = fmax(sides[1], -across - slope * along);
    }
}

void trip_navigation_fit(trip_navigation *n, const double lo[3], const double hi[3], int width,
                         int height, double fill)
{
    pose p = pose_of(n);
    trip_vec3 middle = trip_scale(trip_add(vector(lo), vector(hi)), 0.5), corners[8];
    bool parallel = n->ortho_height > 0;
    double slope_y = parallel ? 0 : tangent(n) * fill, slope_x = slope_y * width / height;
    double x[2], y[2];
    for (int i = 0; i < 8; i++)
        corners[i] = trip_sub(
            trip_v3(i & 1 ? hi[0] : lo[0], i & 2 ? hi[1] : lo[1], i & 4 ? hi[2] : lo[2]), middle);
    reach(corners, p.right, p.forward, slope_x, x);
    reach(corners, p.up, p.forward, slope_y, y);
    trip_vec3 sideways =
        trip_add(trip_scale(p.right, (x[0] - x[1]) / 2), trip_scale(p.up, (y[0] - y[1]) / 2));
    double back =
        parallel ? p.distance : fmax((x[0] + x[1]) / (2 * slope_x), (y[0] + y[1]) / (2 * slope_y));
    trip_vec3 look = trip_add(middle, sideways);
    if (parallel)
        n->ortho_height = fmax(y[0] + y[1], (x[0] + x[1]) * height / width) / fill;
    apply(n, trip_sub(look, trip_scale(p.forward, back)), look, p.up);
}
