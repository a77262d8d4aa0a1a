#include "integrand.h"

#include "shade.h"

enum { MOST_TURNS = 7 };

/* A ray on its way through the values. */
typedef struct passage {
    const trip_integrand *in;
    const trip_ray *ray;
    trip_field_cell cell; /* where it is */
    trip_ray_sum sum;
} passage;

static double code_at(const passage *p, double t)
{
    return trip_field_code(&p->cell, trip_ray_at(p->ray, t));
}

static void sample(void *user, double t, trip_ray_sample *out)
{
    const passage *p = user;
    const trip_integrand *in = p->in;
    trip_vec3 at = trip_ray_at(p->ray, t);
    double extinction = trip_classes_at(in->classes, trip_field_code(&p->cell, at), out->rgb);
    out->extinction = extinction * p->ray->world_per_t;
    if (in->shaded && extinction > 0) {
        double gradient[3];
        trip_field_gradient(&p->cell, at, gradient);
        trip_shade(in->settings, in->camera, in->gradient_full, at, gradient, out->rgb);
    }
}

/* Where the code is `code` between two places, at one of which it is at most that and at the other
 * at least: by halving, to the last bits that matter. */
static double find_code(const passage *p, double code, double a, double b)
{
    bool rises = code_at(p, a) < code_at(p, b);
    for (int i = 0; i < 30; i++) {
        double middle = 0.5 * (a + b);
        if ((code_at(p, middle) < code) == rises)
            a = middle;
        else
            b = middle;
    }
    return 0.5 * (a + b);
}

static void add_visible(passage *p, double from, double to)
{
    double a = code_at(p, from), b = code_at(p, to);
    if (trip_classes_visible(p->in->classes, fmin(a, b), fmax(a, b)))
        trip_ray_sum_add(&p->sum, from, to, sample, p);
}

/* A part of a cell in which the code only rises or only falls: from knot to knot. */
static void add_part(passage *p, double from, double to)
{
    const trip_classes *c = p->in->classes;
    double first = code_at(p, from), last = code_at(p, to);
    double lo = fmin(first, last), hi = fmax(first, last);
    if (!trip_classes_visible(c, lo, hi))
        return;
    size_t begin = trip_classes_knot_above(c, lo), end = begin;
    while (end < c->knot_count && c->knots[end] < hi)
        end++;
    double at = from;
    for (size_t i = 0; i < end - begin; i++) {
        size_t knot = first < last ? begin + i : end - 1 - i;
        double next = find_code(p, c->knots[knot], at, to);
        add_visible(p, at, next);
        at = next;
    }
    add_visible(p, at, to);
}

/* Where the cubic polynomial through the codes at 0, 1, 2, 3 thirds of the way turns: the roots of
 * its derivative by s in (0, 3), from Newton's form with differences d1, d2, d3. */
static int find_turns(const passage *p, double from, double to, double turns[MOST_TURNS])
{
    double f[4];
    for (int i = 0; i < 4; i++)
        f[i] = code_at(p, from + (to - from) * i / 3);
    double d1 = f[1] - f[0], d2 = f[2] - 2 * f[1] + f[0], d3 = f[3] - 3 * f[2] + 3 * f[1] - f[0];
    double a = d3 / 2, b = d2 - d3, c = d1 - d2 / 2 + d3 / 3, root = b * b - 4 * a * c;
    if (!(root > 0))
        return 0;
    double q = -0.5 * (b + copysign(sqrt(root), b));
    double s[2] = { c / q, q / a };
    int count = 0;
    for (int i = 0; i < 2; i++) {
        double at = s[s[0] > s[1] ? 1 - i : i];
        if (at > 0 && at < 3)
            turns[count++] = from + (to - from) * at / 3;
    }
    return count;
}

static int cut_evenly(double from, double to, double turns[MOST_TURNS])
{
    for (int i = 0; i < MOST_TURNS; i++)
        turns[i] = from + (to - from) * (i + 1) / (MOST_TURNS + 1);
    return MOST_TURNS;
}

static bool visit_cell(void *user, const int64_t at[3], double from, double to)
{
    passage *p = user;
    const trip_integrand *in = p->in;
    double turns[MOST_TURNS];
    if (!trip_field_take_cell(in->field, in->settings->kernel, at, &p->cell) ||
        !trip_classes_visible(in->classes, p->cell.least, p->cell.most))
        return true;
    int count = p->cell.edge == 2 ? find_turns(p, from, to, turns) : cut_evenly(from, to, turns);
    double begin = from;
    for (int i = 0; i < count; i++) {
        add_part(p, begin, turns[i]);
        begin = turns[i];
    }
    add_part(p, begin, to);
    return !trip_ray_sum_is_over(&p->sum);
}

static bool visit_cube(void *user, const int64_t at[3], double from, double to)
{
    passage *p = user;
    const trip_integrand *in = p->in;
    const trip_field_cube *cube = trip_field_cube_at(in->field, at);
    const int64_t *dims = trip_field_dims(in->field);
    double bounds[2];
    if (!cube)
        return true;
    trip_field_code_bounds(in->settings->kernel, cube->range[0], cube->range[1], bounds);
    if (!trip_classes_visible(in->classes, bounds[0], bounds[1]))
        return true;
    trip_ray_boxes cells = { .edge = 1 };
    for (int a = 0; a < 3; a++) {
        int64_t past = at[a] + TRIP_FIELD_EDGE;
        cells.lo[a] = at[a];
        cells.hi[a] = past < dims[a] - 1 ? past : dims[a] - 1;
    }
    return trip_ray_walk(p->ray, &cells, from, to, visit_cell, p);
}

trip_ray_sum trip_integrate_values(const trip_integrand *in, const trip_ray *ray)
{
    const int64_t *dims = trip_field_dims(in->field);
    const trip_ray_boxes cubes = { .hi = { dims[0] - 1, dims[1] - 1, dims[2] - 1 },
                                   .edge = TRIP_FIELD_EDGE };
    double from = 0, to = INFINITY;
    passage p = { .in = in, .ray = ray, .sum = trip_ray_sum_begin(in->settings->tolerance, 1) };
    if (trip_ray_clip(ray, cubes.lo, cubes.hi, &from, &to)) {
        p.sum.length = to - from;
        trip_ray_walk(ray, &cubes, from, to, visit_cube, &p);
    }
    return p.sum;
}
