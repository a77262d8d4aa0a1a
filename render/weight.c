#include "weight.h"

static double largest(trip_vec3 r)
{
    return fmax(fabs(r.x), fmax(fabs(r.y), fabs(r.z)));
}

static int largest_axis(trip_vec3 r)
{
    double x = fabs(r.x), y = fabs(r.y), z = fabs(r.z);
    if (x >= y && x >= z)
        return 0;
    return y >= z ? 1 : 2;
}

double trip_weight(const trip_settings *s, int axis_of_view, trip_vec3 ray, int axis)
{
    switch (s->method) {
    case TRIP_METHOD_AXIS:
        return axis == axis_of_view;
    case TRIP_METHOD_CLIP:
        return axis == largest_axis(ray);
    case TRIP_METHOD_MERGE:
        break;
    }
    return fmax(0, (fabs(trip_component(ray, axis)) / largest(ray) - s->h) / (1 - s->h));
}

int trip_weight_axis_of_view(const trip_camera *c)
{
    return largest_axis(trip_camera_ray(c, 0.5 * c->width, 0.5 * c->height));
}

bool trip_weight_may_reach(const trip_settings *s, const trip_camera *c, int axis_of_view, int axis,
                           trip_vec3 centre_from_eye, double radius)
{
    if (s->method == TRIP_METHOD_AXIS)
        return axis == axis_of_view;
    if (c->ortho)
        return trip_weight(s, axis_of_view, c->r0, axis) > 0;
    double h = s->method == TRIP_METHOD_CLIP ? 1 : s->h;
    double bound = fabs(trip_component(centre_from_eye, axis)) - h * largest(centre_from_eye) +
                   sqrt(1 + h * h) * radius;
    return s->method == TRIP_METHOD_CLIP ? bound >= 0 : bound > 0;
}
