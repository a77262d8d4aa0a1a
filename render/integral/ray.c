#include "ray.h"

static double inverse(double x)
{
    return x != 0 ? 1 / x : NAN;
}

trip_ray trip_ray_make(const trip_camera *c, double x, double y)
{
    trip_ray r = { .origin = c->eye, .direction = trip_camera_ray(c, x, y), .end = INFINITY };
    if (c->ortho)
        r.origin = trip_add(r.origin, trip_add(trip_scale(c->rx, x), trip_scale(c->ry, y)));
    r.inverse = trip_v3(inverse(r.direction.x), inverse(r.direction.y), inverse(r.direction.z));
    r.world_per_t = trip_length(trip_affine_vector(&c->index_to_world, r.direction));
    return r;
}

trip_ray trip_ray_from(trip_vec3 origin, trip_vec3 direction, double world_per_t, double end)
{
    return (trip_ray){ .origin = origin,
                       .direction = direction,
                       .end = end,
                       .inverse = trip_v3(inverse(direction.x), inverse(direction.y),
                                          inverse(direction.z)),
                       .world_per_t = world_per_t };
}

static double face_at(const trip_ray_boxes *b, int axis, int64_t face)
{
    return b->coordinates ? trip_coordinates_at(b->coordinates, axis, face) : (double)face;
}

bool trip_ray_clip(const trip_ray *r, const trip_ray_boxes *b, double *from, double *to)
{
    for (int a = 0; a < 3; a++) {
        double o = trip_component(r->origin, a), d = trip_component(r->direction, a);
        double lo = face_at(b, a, b->lo[a]), hi = face_at(b, a, b->hi[a]);
        double near = d < 0 ? hi : lo, far = d < 0 ? lo : hi;
        if (d == 0 && (o < near || o > far))
            return false;
        if (d == 0)
            continue;
        double enter = (near - o) * trip_component(r->inverse, a);
        double leave = (far - o) * trip_component(r->inverse, a);
        *from = enter > *from ? enter : *from;
        *to = leave < *to ? leave : *to;
    }
    return *from < *to;
}

/* Finds the cube that contains a point, or the nearest one. */
static void find_box(const trip_ray_boxes *b, trip_vec3 p, int64_t at[3])
{
    for (int a = 0; a < 3; a++) {
        double x = trip_component(p, a);
        x = b->coordinates ? trip_coordinates_index(b->coordinates, a, x) : x;
        x = fmin((double)b->hi[a], fmax((double)b->lo[a], x));
        int64_t steps = ((int64_t)floor(x) - b->lo[a]) / b->edge;
        int64_t last = (b->hi[a] - 1 - b->lo[a]) / b->edge;
        at[a] = b->lo[a] + (steps < last ? steps : last) * b->edge;
    }
}

/* The walk along one axis. */
typedef struct pace {
    double origin, inverse; /* of the ray */
    /* To the next cube; from a cube's first corner to the face where the ray leaves. */
    int64_t step, to_face;
} pace;

static pace make_pace(const trip_ray *r, int axis, int64_t edge)
{
    double d = trip_component(r->direction, axis);
    return (pace){ .origin = trip_component(r->origin, axis),
                   .inverse = trip_component(r->inverse, axis),
                   .step = d > 0 ? edge : -edge,
                   .to_face = d > 0 ? edge : 0 };
}

/* Finds where the ray leaves a cube, at most `to`. Returns the face's axis, or -1. */
static int find_exit(const pace paces[3], const trip_ray_boxes *b, const int64_t at[3], double *to)
{
    int axis = -1;
    for (int a = 0; a < 3; a++) {
        int64_t face = at[a] + paces[a].to_face;
        double away = face_at(b, a, face < b->hi[a] ? face : b->hi[a]) - paces[a].origin;
        double t = away * paces[a].inverse;
        if (t < *to) { /* false for NaN */
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
    pace paces[3];
    if (!trip_ray_clip(r, boxes, &from, &to))
        return true;
    find_box(boxes, trip_ray_at(r, from), at);
    for (int a = 0; a < 3; a++)
        paces[a] = make_pace(r, a, boxes->edge);
    while (from < to) {
        double exit = to;
        int axis = find_exit(paces, boxes, at, &exit);
        exit = exit > from ? exit : from; /* rounding */
        if (!visit(user, at, from, exit))
            return false;
        if (axis < 0)
            break;
        at[axis] += paces[axis].step;
        if (at[axis] < boxes->lo[axis] || at[axis] >= boxes->hi[axis])
            break;
        from = exit;
    }
    return true;
}
