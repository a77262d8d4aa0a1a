#include "ray.h"

trip_ray trip_ray_make(const trip_camera *c, double x, double y)
{
    trip_ray r = { .origin = c->eye, .direction = trip_camera_ray(c, x, y) };
    if (c->ortho)
        r.origin = trip_add(r.origin, trip_add(trip_scale(c->rx, x), trip_scale(c->ry, y)));
    r.world_per_t = trip_length(trip_affine_vector(&c->index_to_world, r.direction));
    return r;
}

bool trip_ray_clip(const trip_ray *r, const int64_t lo[3], const int64_t hi[3], double *from,
                   double *to)
{
    for (int a = 0; a < 3; a++) {
        double o = trip_component(r->origin, a), d = trip_component(r->direction, a);
        double near = (double)(d < 0 ? hi[a] : lo[a]), far = (double)(d < 0 ? lo[a] : hi[a]);
        if (d == 0 && (o < near || o > far))
            return false;
        if (d == 0)
            continue;
        *from = fmax(*from, (near - o) / d);
        *to = fmin(*to, (far - o) / d);
    }
    return *from < *to;
}

/* The box that holds a point, or the nearest one. */
static void find_box(const trip_ray_boxes *b, trip_vec3 p, int64_t at[3])
{
    for (int a = 0; a < 3; a++) {
        double x = fmin((double)b->hi[a], fmax((double)b->lo[a], trip_component(p, a)));
        int64_t steps = ((int64_t)floor(x) - b->lo[a]) / b->edge;
        int64_t last = (b->hi[a] - 1 - b->lo[a]) / b->edge;
        at[a] = b->lo[a] + (steps < last ? steps : last) * b->edge;
    }
}

/* Where the ray leaves a box, at most `to`; the axis of that face, or -1. */
static int find_exit(const trip_ray *r, const trip_ray_boxes *b, const int64_t at[3], double *to)
{
    int axis = -1;
    for (int a = 0; a < 3; a++) {
        double o = trip_component(r->origin, a), d = trip_component(r->direction, a);
        int64_t face = at[a] + (d > 0 ? b->edge : 0);
        double t = d != 0 ? ((double)(face < b->hi[a] ? face : b->hi[a]) - o) / d : INFINITY;
        if (t < *to) {
            *to = t;
            axis = a;
        }
    }
    return axis;
}

bool trip_ray_walk(const trip_ray *r, const trip_ray_boxes *boxes, double from, double to,
                   trip_ray_visit visit, void *user)
{
    int64_t at[3];
    if (!trip_ray_clip(r, boxes->lo, boxes->hi, &from, &to))
        return true;
    find_box(boxes, trip_ray_at(r, from), at);
    while (from < to) {
        double exit = to;
        int axis = find_exit(r, boxes, at, &exit);
        exit = fmax(exit, from); /* rounding */
        if (!visit(user, at, from, exit))
            return false;
        if (axis < 0)
            break;
        at[axis] += trip_component(r->direction, axis) > 0 ? boxes->edge : -boxes->edge;
        if (at[axis] < boxes->lo[axis] || at[axis] >= boxes->hi[axis])
            break;
        from = exit;
    }
    return true;
}
