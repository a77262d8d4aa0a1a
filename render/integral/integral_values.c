#include "cell.h"
#include "integrand.h"

#include <string.h>

/* A ray through the values. */
typedef struct passage {
    const trip_integrand *in;
    const trip_ray *ray;
    trip_light light; /* the same along the whole ray, except for a point light */
    trip_effects_view effects;
    trip_cell_line line; /* of the current cell */
    double box[4];       /* nearest value: code and gradient in the current box */
    trip_ray_sum sum;
} passage;

static trip_light light_at(const trip_integrand *in, trip_vec3 position)
{
    return trip_light_at(in->settings, in->camera, in->gradient_full, position);
}

static void sample(void *user, double t, trip_ray_sample *out)
{
    const passage *p = user;
    double here[4]; /* code, gradient */
    if (p->in->nearest)
        memcpy(here, p->box, sizeof here);
    else
        trip_cell_line_at(&p->line, t, here);
    double extinction = trip_classes_at(p->in->classes, here[0], out->rgb);
    const bool effects = trip_effects_some(&p->effects.effects);
    out->extinction = extinction * p->ray->world_per_t;
    out->form = 1;
    if (!(extinction > 0) || !(effects || p->in->shaded))
        return;
    const trip_vec3 position = trip_ray_at(p->ray, t);
    const trip_light light = p->in->settings->point_light ? light_at(p->in, position) : p->light;
    if (effects) {
        trip_effects_colour(&p->effects, &light, position, p->in->shaded ? here + 1 : NULL,
                            out->rgb);
        out->form = 0;
    } else {
        out->form = trip_light_colour(&light, here + 1, out->rgb);
    }
}

/* A position in a cell, 0 to 1 along its line, and the code there. */
typedef struct position {
    double x, code;
} position;

static position position_at(const passage *p, double x)
{
    return (position){ x, trip_polynomial_at(&p->line.code, x) };
}

static trip_ray_end end_at(passage *p, double x)
{
    return trip_ray_end_at(trip_cell_line_t(&p->line, x), sample, p);
}

/* Adds the part between two positions, knot by knot. The code must rise or fall throughout. */
static void add_between(passage *p, position first, position last)
{
    const trip_classes *c = p->in->classes;
    const bool rises = first.code < last.code;
    const double lo = rises ? first.code : last.code, hi = rises ? last.code : first.code;
    if (!trip_classes_visible(c, lo, hi))
        return;
    size_t begin = trip_classes_knot_above(c, lo), end = trip_classes_knot_from(c, hi);
    end = end < begin ? begin : end; /* constant code on a knot */
    trip_ray_end from = end_at(p, first.x);
    for (size_t n = begin; n < end + 1 && !trip_ray_sum_is_over(&p->sum); n++) {
        position next = last;
        if (n < end) {
            next.code = c->knots[rises ? n : begin + end - 1 - n];
            next.x = trip_polynomial_find(&p->line.code, next.code, first.x, last.x);
        }
        const trip_ray_end to = end_at(p, next.x);
        if (trip_classes_visible(c, rises ? first.code : next.code, rises ? next.code : first.code))
            trip_ray_sum_add(&p->sum, &from, &to, sample, p);
        from = to;
        first = next;
    }
}

/* Adds the part of a ray in the box of one of the cell's corners, where code and gradient are
 * constant. */
static void add_box(passage *p, const trip_field_cell *cell, double from, double to)
{
    const trip_integrand *in = p->in;
    const trip_vec3 middle = trip_ray_at(p->ray, 0.5 * (from + to));
    int64_t at[3];
    for (int a = 0; a < 3; a++) {
        const double x =
            trip_coordinates_index(in->coordinates, a, trip_component(middle, a)) + 0.5;
        at[a] = cell->at[a] + (x >= (double)(cell->at[a] + 1));
    }
    p->box[0] = trip_field_at(in->field, at[0], at[1], at[2])->code;
    if (!trip_classes_visible(in->classes, p->box[0], p->box[0]))
        return;
    if (in->shaded) {
        double g[3];
        trip_field_outline(in->field, in->coordinates, at, g);
        const trip_vec3 world =
            trip_affine_transpose_vector(&in->to_index, trip_v3(g[0], g[1], g[2]));
        p->box[1] = world.x;
        p->box[2] = world.y;
        p->box[3] = world.z;
    }
    const trip_ray_end first = trip_ray_end_at(from, sample, p),
                       last = trip_ray_end_at(to, sample, p);
    trip_ray_sum_add(&p->sum, &first, &last, sample, p);
}

/* Adds a cell box by box. The boxes of its corners meet half-way along each axis. */
static void add_boxes(passage *p, const trip_field_cell *cell, double from, double to)
{
    double ends[5] = { from };
    int count = 1;
    for (int a = 0; a < 3; a++) {
        const double d = trip_component(p->ray->direction, a);
        const double half =
            trip_coordinates_position(p->in->coordinates, a, (double)cell->at[a] + 0.5);
        const double t = (half - trip_component(p->ray->origin, a)) / d;
        if (!(d != 0 && t > from && t < to))
            continue;
        int n = count++;
        for (; n > 1 && ends[n - 1] > t; n--)
            ends[n] = ends[n - 1];
        ends[n] = t;
    }
    ends[count] = to;
    for (int n = 0; n < count && !trip_ray_sum_is_over(&p->sum); n++)
        if (ends[n] < ends[n + 1])
            add_box(p, cell, ends[n], ends[n + 1]);
}

static bool visit_cell(void *user, const int64_t at[3], double from, double to)
{
    passage *p = user;
    const trip_integrand *in = p->in;
    trip_field_cell cell;
    double turns[TRIP_POLYNOMIAL_DEGREE];
    if (!(from < to) || !trip_field_take_cell(in->field, in->settings->kernel, at, &cell) ||
        !trip_classes_visible(in->classes, cell.min, cell.max))
        return true;
    if (in->nearest) {
        add_boxes(p, &cell, from, to);
        return !trip_ray_sum_is_over(&p->sum);
    }
    p->line = trip_cell_along(&cell, in->coordinates, p->ray, from, to);
    int count = trip_polynomial_turns(&p->line.code, turns);
    position here = position_at(p, 0);
    for (int i = 0; i <= count; i++) {
        position next = position_at(p, i < count ? turns[i] : 1);
        add_between(p, here, next);
        here = next;
    }
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
    const trip_field_unit unit = trip_field_get_unit(in->field);
    trip_field_code_bounds(in->settings->kernel, trip_field_code(unit, cube->range[0]),
                           trip_field_code(unit, cube->range[1]), bounds);
    if (!trip_classes_visible(in->classes, bounds[0], bounds[1]))
        return true;
    trip_ray_boxes cells = { .edge = 1, .coordinates = in->coordinates };
    for (int a = 0; a < 3; a++) {
        int64_t past = at[a] + TRIP_FIELD_EDGE;
        cells.lo[a] = at[a];
        cells.hi[a] = past < dims[a] - 1 ? past : dims[a] - 1;
    }
    return trip_ray_walk(p->ray, &cells, from, to, visit_cell, p);
}

/* Returns the transmittance along a ray. */
static double through(const trip_integrand *in, const trip_ray *ray)
{
    trip_integrand bare = *in;
    bare.shaded = false;
    bare.effects.effects = (trip_effects){ 0 };
    return trip_integrate_values(&bare, ray).transmittance;
}

static double reached_at(const void *user, trip_vec3 voxel)
{
    const trip_integrand *in = user;
    trip_ray ray = trip_ray_from(voxel, in->effects.light, 1, INFINITY);
    if (in->effects.point_light) {
        const trip_vec3 way = trip_sub(in->effects.light, voxel);
        const trip_vec3 world = trip_affine_vector(&in->camera->index_to_world, way);
        ray = trip_ray_from(voxel, way, trip_length(world), 1);
    }
    return through(in, &ray);
}

static double open_at(const void *user, trip_vec3 voxel)
{
    const trip_integrand *in = user;
    double sum = 0;
    for (int n = 0; n < TRIP_OPEN_DIRECTIONS; n++) {
        const trip_ray ray = trip_ray_from(
            voxel, trip_affine_vector(&in->effects.to_index, trip_effects_direction(n)), 1,
            INFINITY);
        sum += through(in, &ray);
    }
    return sum / TRIP_OPEN_DIRECTIONS;
}

static trip_effects_view effects_of(const trip_integrand *in)
{
    trip_effects_view effects = in->effects;
    effects.user = in;
    effects.reached = reached_at;
    effects.open = open_at;
    return effects;
}

trip_ray_sum trip_integrate_values(const trip_integrand *in, const trip_ray *ray)
{
    const int64_t *dims = trip_field_dims(in->field);
    const trip_ray_boxes cubes = { .hi = { dims[0] - 1, dims[1] - 1, dims[2] - 1 },
                                   .edge = TRIP_FIELD_EDGE,
                                   .coordinates = in->coordinates };
    double from = 0, to = ray->end;
    passage p = { .in = in, .ray = ray, .sum = trip_ray_sum_begin(in->tolerance, 1) };
    if (trip_ray_clip(ray, &cubes, &from, &to) &&
        trip_clip_ray(in->clip, ray->origin, ray->direction, &from, &to)) {
        p.light = light_at(in, trip_ray_at(ray, 1));
        if (trip_effects_some(&in->effects.effects))
            p.effects = effects_of(in);
        p.sum.length = to - from;
        trip_ray_walk(ray, &cubes, from, to, visit_cube, &p);
    }
    return p.sum;
}
