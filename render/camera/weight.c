#include "weight.h"

/* As fmax() and fmin(), without the call. The arguments are never NaN. */
static double larger(double a, double b)
{
    return a > b ? a : b;
}

static double smaller(double a, double b)
{
    return a < b ? a : b;
}

static double largest(trip_vec3 r)
{
    return larger(fabs(r.x), larger(fabs(r.y), fabs(r.z)));
}

static int largest_axis(trip_vec3 r)
{
    double x = fabs(r.x), y = fabs(r.y), z = fabs(r.z);
    if (x >= y && x >= z)
        return 0;
    return y >= z ? 1 : 2;
}

double trip_weight_signed(const trip_settings *s, trip_vec3 ray, int axis)
{
    const double h = trip_settings_h(s);
    return (fabs(trip_component(ray, axis)) / largest(ray) - h) / (1 - h);
}

double trip_weight(const trip_settings *s, int axis_of_view, trip_vec3 ray, int axis)
{
    switch (s->method) {
    case TRIP_METHOD_AXIS:
    case TRIP_METHOD_IMAGE:
        return axis == axis_of_view;
    case TRIP_METHOD_CLIP:
        return axis == largest_axis(ray);
    case TRIP_METHOD_MERGE:
        break;
    }
    return larger(0, trip_weight_signed(s, ray, axis));
}

int trip_weight_axis_of_view(const trip_camera *c)
{
    return largest_axis(trip_camera_ray(c, 0.5 * c->width, 0.5 * c->height));
}

bool trip_weight_may_reach(const trip_settings *s, const trip_camera *c, int axis_of_view, int axis,
                           trip_vec3 centre_from_eye, double radius)
{
    if (trip_settings_has_one_list(s))
        return axis == axis_of_view;
    if (c->ortho)
        return trip_weight(s, axis_of_view, c->r0, axis) > 0;
    double h = trip_weight_h(s);
    double bound = fabs(trip_component(centre_from_eye, axis)) - h * largest(centre_from_eye) +
                   sqrt(1 + h * h) * radius;
    return s->method == TRIP_METHOD_CLIP ? bound >= 0 : bound > 0;
}

bool trip_weight_of_two_points(const trip_settings *s, int axis, trip_vec3 centre_from_eye,
                               trip_vec3 beside)
{
    const double w = trip_weight_signed(s, centre_from_eye, axis);
    const double v = trip_weight_signed(s, trip_add(centre_from_eye, beside), axis);
    return w + fabs(w - v) > 0;
}

trip_ray_bounds trip_ray_bounds_of(const double lo[3], const double hi[3])
{
    trip_ray_bounds b;
    for (int a = 0; a < 3; a++) {
        b.lo[a] = lo[a];
        b.hi[a] = hi[a];
        b.min[a] = larger(0, larger(lo[a], -hi[a]));
        b.max[a] = larger(fabs(lo[a]), fabs(hi[a]));
    }
    return b;
}

trip_ray_bounds trip_ray_bounds_over(const trip_camera *c, const double from[2], const double to[2])
{
    double lo[3], hi[3];
    for (int a = 0; a < 3; a++) {
        lo[a] = hi[a] = trip_component(c->r0, a);
        if (c->ortho)
            continue;
        double x = trip_component(c->rx, a), y = trip_component(c->ry, a);
        lo[a] += smaller(x * from[0], x * to[0]) + smaller(y * from[1], y * to[1]);
        hi[a] += larger(x * from[0], x * to[0]) + larger(y * from[1], y * to[1]);
    }
    return trip_ray_bounds_of(lo, hi);
}

bool trip_weight_may_lie(const trip_settings *s, int axis_of_view, const trip_ray_bounds *bounds,
                         int axis)
{
    if (trip_settings_has_one_list(s))
        return axis == axis_of_view;
    double min = larger(bounds->min[0], larger(bounds->min[1], bounds->min[2]));
    return !(bounds->max[axis] * (1 + 1e-9) < trip_weight_h(s) * min); /* room for rounding */
}

bool trip_way_may_lie(const trip_ray_bounds *bounds, int axis, trip_way way)
{
    const double *max = bounds->max;
    double room = 1e-9 * larger(max[0], larger(max[1], max[2])); /* for rounding */
    if (way == TRIP_WAY_UP)
        return bounds->hi[axis] >= -room;
    return way == TRIP_WAY_ANY || bounds->lo[axis] <= room;
}

/* Pixels, inclusive. */
typedef struct rectangle {
    int lo[2], hi[2];
} rectangle;

/* Searches the rectangle by halving it. */
static bool some_pixel_weighs(const trip_settings *s, const trip_camera *c, int axis_of_view,
                              int axis, trip_way way, const rectangle *r)
{
    int middle[2] = { r->lo[0] + (r->hi[0] - r->lo[0]) / 2, r->lo[1] + (r->hi[1] - r->lo[1]) / 2 };
    trip_vec3 ray = trip_camera_ray(c, middle[0] + 0.5, middle[1] + 0.5);
    if (trip_weight(s, axis_of_view, ray, axis) > 0 &&
        (way == TRIP_WAY_ANY || trip_ray_goes(ray, axis) == way))
        return true;
    if (r->lo[0] == r->hi[0] && r->lo[1] == r->hi[1])
        return false;
    const double from[2] = { r->lo[0] + 0.5, r->lo[1] + 0.5 };
    const double to[2] = { r->hi[0] + 0.5, r->hi[1] + 0.5 };
    trip_ray_bounds bounds = trip_ray_bounds_over(c, from, to);
    if (!trip_weight_may_lie(s, axis_of_view, &bounds, axis) ||
        !trip_way_may_lie(&bounds, axis, way))
        return false;
    int d = r->hi[0] - r->lo[0] >= r->hi[1] - r->lo[1] ? 0 : 1;
    rectangle first = *r, second = *r;
    first.hi[d] = middle[d];
    second.lo[d] = middle[d] + 1;
    return some_pixel_weighs(s, c, axis_of_view, axis, way, &first) ||
           some_pixel_weighs(s, c, axis_of_view, axis, way, &second);
}

bool trip_weight_is_somewhere(const trip_settings *s, const trip_camera *c, int axis_of_view,
                              int axis, trip_way way)
{
    if (trip_settings_has_one_list(s) && axis != axis_of_view)
        return false;
    const rectangle all = { { 0, 0 }, { c->width - 1, c->height - 1 } },
                    one = { { 0, 0 }, { 0, 0 } };
    return some_pixel_weighs(s, c, axis_of_view, axis, way, c->ortho ? &one : &all);
}

/* Tests the corner pixels alone. Rays with weight and a given sign of r_a form a convex cone, so
 * the corners decide for all pixels. */
bool trip_weight_is_everywhere(const trip_settings *s, const trip_camera *c, int axis_of_view,
                               int axis)
{
    if (c->ortho || trip_settings_has_one_list(s))
        return true;
    double sign = trip_component(trip_camera_ray(c, 0.5, 0.5), axis);
    for (int i = 0; i < 4; i++) {
        trip_vec3 ray =
            trip_camera_ray(c, i & 1 ? c->width - 0.5 : 0.5, i & 2 ? c->height - 0.5 : 0.5);
        if (!(trip_weight(s, axis_of_view, ray, axis) > 0) ||
            !(sign * trip_component(ray, axis) > 0))
            return false;
    }
    return true;
}
