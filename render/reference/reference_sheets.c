#include "reference_sheets.h"

#include <string.h>

#include "blurred_function.h"
#include "emission.h"
#include "field_fill.h"
#include "light_map.h"
#include "segments.h"
#include "shade.h"
#include "debug_view.h"
#include "sheet.h"

struct trip_reference_sheets {
    trip_budget *budget;
    const trip_frame *frame;
    trip_affine to_index;
    const trip_coordinates *coordinates;
    double value_per_code, gradient_full;
    double early_termination;
    trip_field *field;      /* gradients are in index space, codes per index; or of outlines */
    trip_field *deviations; /* of the voxels as codes (deviation.h); NULL if nothing is blurred */
    bool nearest, has_gradients;
    trip_field_fill fill;
    trip_segments segments;
    trip_blurred_function blurred;
    trip_effects_view effects;
};

/* Takes the memory that blurring needs, and blurs the function. */
static int begin_blurring(trip_reference_sheets *s, const int64_t dims[3])
{
    int status = trip_field_create(&s->deviations, dims, s->budget);
    if (status)
        return status;
    s->fill.deviations = s->deviations;
    if (trip_blurred_function_create(&s->blurred, s->frame->table, s->budget))
        return 0;
    return trip_fail(TRIP_ERROR, "render", "reference renderer",
                     "the blurred transfer function does not fit the memory given; raise --memory");
}

int trip_reference_sheets_create(trip_reference_sheets **out, const trip_frame *frame,
                                 trip_budget *budget)
{
    const trip_dataset *data = frame->data;
    const trip_file_header *h = &data->header;
    const int64_t dims[3] = { (int64_t)h->dims[0], (int64_t)h->dims[1], (int64_t)h->dims[2] };
    trip_reference_sheets *s = *out = trip_budget_take(budget, sizeof *s);
    if (!s)
        return trip_fail(TRIP_ERROR, "render", "reference renderer",
                         "out of memory; raise --memory");
    s->budget = budget;
    s->frame = frame;
    trip_affine_invert(&data->index_to_world, &s->to_index); /* invertible: checked on opening */
    s->coordinates = &data->coordinates;
    s->early_termination = trip_settings_early_termination(frame->settings);
    s->nearest = frame->settings->kernel == TRIP_KERNEL_NEAREST;
    s->value_per_code = s->nearest ? 1 : trip_draw_value_per_code(&frame->plan->draw);
    s->gradient_full =
        s->nearest ? trip_shade_outline_full(&data->index_to_world, data->coordinates.widest)
                   : trip_shade_gradient_full(h, frame->settings, frame->camera->voxel_world,
                                              frame->plan->level);
    int status = trip_field_create(&s->field, dims, budget);
    if (!status) {
        trip_field_fill_begin(&s->fill, data, &frame->plan->draw, s->field,
                              1u << TRIP_PLANE_VOXELS);
        status = frame->plan->blurs ? begin_blurring(s, dims) : 0;
    }
    if (status) {
        trip_reference_sheets_destroy(s);
        *out = NULL;
        return status;
    }
    trip_segments_make(&s->segments, frame->table);
    s->effects = trip_effects_view_make(frame->settings, frame->camera, h->dims);
    trip_light_map_view(frame->light, &s->effects);
    if (frame->settings->effects.emission)
        s->effects.emission = trip_emission_view_of(frame->emission);
    return 0;
}

void trip_reference_sheets_destroy(trip_reference_sheets *s)
{
    if (!s)
        return;
    trip_field_destroy(s->field);
    trip_field_destroy(s->deviations);
    if (s->blurred.entries)
        trip_blurred_function_destroy(&s->blurred, s->budget);
    trip_budget_release(s->budget, s, sizeof *s);
}

int trip_reference_sheets_put(trip_reference_sheets *s, const trip_batch *batch,
                              const trip_run *run)
{
    s->has_gradients = false;
    return trip_field_fill_run(&s->fill, batch, run);
}

/* Returns the difference of codes along an axis at a present voxel, in codes per index. With uneven
 * spacing it is in codes per unit of position. */
static double difference(const trip_reference_sheets *s, const int64_t at[3], int axis)
{
    const trip_field *field = s->field;
    const int64_t d[3] = { axis == 0, axis == 1, axis == 2 };
    double here = trip_field_at(field, at[0], at[1], at[2])->code;
    const trip_field_voxel *after = trip_field_at(field, at[0] + d[0], at[1] + d[1], at[2] + d[2]);
    const trip_field_voxel *before = trip_field_at(field, at[0] - d[0], at[1] - d[1], at[2] - d[2]);
    const double rise =
        (after ? (double)after->code : here) - (before ? (double)before->code : here);
    const int64_t first = before ? at[axis] - 1 : at[axis], last = after ? at[axis] + 1 : at[axis];
    return last > first ? rise / (trip_coordinates_at(s->coordinates, axis, last) -
                                  trip_coordinates_at(s->coordinates, axis, first))
                        : 0;
}

/* Sets the gradient of a voxel, or with the nearest value the gradient of its outline. The field's
 * single precision holds differences of whole codes exactly. */
static int set_gradient(const trip_reference_sheets *s, const int64_t at[3])
{
    trip_field *field = s->field;
    const trip_field_voxel *v = trip_field_at(field, at[0], at[1], at[2]);
    if (!v)
        return 0;
    double g[3];
    if (s->nearest)
        trip_field_outline(field, s->coordinates, at, g);
    for (int a = 0; a < 3 && !s->nearest; a++)
        g[a] = difference(s, at, a);
    return trip_field_put(field, at, v->code, g);
}

int trip_reference_sheets_prepare(trip_reference_sheets *s)
{
    enum { EDGE = TRIP_FIELD_EDGE };
    int status = 0;
    if (s->has_gradients || !s->frame->settings->shading)
        return 0;
    for (size_t i = 0; i < trip_field_cubes(s->field) && !status; i++) {
        const int64_t *first = trip_field_cube_by_number(s->field, i)->at;
        for (int n = 0; n < EDGE * EDGE * EDGE && !status; n++) {
            const int64_t at[3] = { first[0] + n % EDGE, first[1] + n / EDGE % EDGE,
                                    first[2] + n / (EDGE * EDGE) };
            status = set_gradient(s, at);
        }
        status = status ? status : trip_frame_poll();
    }
    s->has_gradients = status == 0;
    return status;
}

/* A ray in the cells between sheets. */
typedef struct passage {
    const trip_reference_sheets *s;
    int axis;
    trip_vec3 origin, direction;
    double world_per_t;
    double from, to; /* part of the ray inside the clipping planes and the grid's sides, in t */
    double layer[TRIP_CHANNELS_MAX];
} passage;

/* A sample: the voxels it is interpolated from, their weights, the code, and the code of the
 * deviation. */
typedef struct position {
    trip_field_cell cell;
    double weights[64];
    double code, deviation;
} position;

static trip_vec3 point_at(const passage *p, double t)
{
    return trip_add(p->origin, trip_scale(p->direction, t));
}

/* Returns the index of a point given by its position. */
static trip_vec3 index_at(const passage *p, trip_vec3 point)
{
    const trip_coordinates *c = p->s->coordinates;
    return trip_v3(trip_coordinates_index(c, 0, point.x), trip_coordinates_index(c, 1, point.y),
                   trip_coordinates_index(c, 2, point.z));
}

/* Sets the weights of the cell's voxels, i fastest. */
static void set_weights(trip_kernel kernel, position *at, trip_vec3 point)
{
    const int edge = at->cell.edge, first = edge == 2;
    double w[3][TRIP_KERNEL_TAPS];
    for (int a = 0; a < 3; a++)
        trip_kernel_weights(kernel, trip_component(point, a) - (double)at->cell.at[a], w[a]);
    for (int n = 0; n < edge * edge * edge; n++)
        at->weights[n] = w[0][first + n % edge] * w[1][first + n / edge % edge] *
                         w[2][first + n / (edge * edge)];
}

/* Finds the corners of a cell. For a sample at a sheet it takes the four corners there twice.
 * Returns false if one is missing. */
static bool take_corners(const passage *p, const trip_field *field, const int64_t cell[3],
                         double coordinate, trip_field_cell *out)
{
    const bool at_sheet = coordinate == floor(coordinate);
    memcpy(out->at, cell, sizeof out->at);
    out->edge = 2;
    for (int n = 0; n < 8; n++) {
        int64_t at[3] = { cell[0] + (n & 1), cell[1] + (n >> 1 & 1), cell[2] + (n >> 2) };
        at[p->axis] = at_sheet ? (int64_t)coordinate : at[p->axis];
        out->voxels[n] = trip_field_at(field, at[0], at[1], at[2]);
        if (!out->voxels[n])
            return false;
    }
    return true;
}

static bool take_cell(const passage *p, const trip_field *field, const int64_t cell[3],
                      double coordinate, trip_field_cell *out)
{
    const trip_kernel kernel = p->s->frame->settings->kernel;
    return kernel != TRIP_KERNEL_LINEAR ? trip_field_take_cell(field, kernel, cell, out)
                                        : take_corners(p, field, cell, coordinate, out);
}

static double weighted(const trip_field_cell *cell, const double weights[64])
{
    double sum = 0;
    for (int n = 0; n < cell->edge * cell->edge * cell->edge; n++)
        sum += weights[n] * cell->voxels[n]->code;
    return sum;
}

/* Interpolates the code of a sample and of its deviation. Returns false if a voxel is missing. */
static bool interpolate(const passage *p, const int64_t cell[3], trip_vec3 point, double coordinate,
                        position *at)
{
    trip_field_cell deviations;
    if (!take_cell(p, p->s->field, cell, coordinate, &at->cell))
        return false;
    set_weights(p->s->frame->settings->kernel, at, point);
    at->code = weighted(&at->cell, at->weights);
    at->deviation = 0;
    if (p->s->deviations && take_cell(p, p->s->deviations, cell, coordinate, &deviations))
        at->deviation = fmin(TRIP_DEVIATION_MAX, fmax(0, weighted(&deviations, at->weights)));
    return true;
}

/* Returns t where the ray reaches a coordinate of the axis, in indices. */
static double reached_at(const passage *p, double coordinate)
{
    return (trip_coordinates_position(p->s->coordinates, p->axis, coordinate) -
            trip_component(p->origin, p->axis)) /
           trip_component(p->direction, p->axis);
}

/* Computes the sample at a coordinate, where the ray is at t. The coordinate lies at the sheet
 * `cells` or between it and the next. Beyond a side of the grid, the position is the nearest one in
 * the grid. Returns false in empty cells. */
static bool find_position(const passage *p, double coordinate, double t, int64_t cells,
                          position *at)
{
    const int64_t *dims = trip_field_dims(p->s->field);
    const trip_vec3 point = index_at(p, point_at(p, t));
    double x[3];
    int64_t cell[3];
    for (int a = 0; a < 3; a++) {
        const double last = (double)dims[a] - 1;
        x[a] = trip_component(point, a);
        if (a != p->axis)
            x[a] = fmin(fmax(x[a], 0), last);
        cell[a] = a == p->axis ? cells : (int64_t)fmin(floor(x[a]), last - 1);
    }
    return interpolate(p, cell, trip_v3(x[0], x[1], x[2]), coordinate, at);
}

static trip_vec3 gradient_at(const position *at)
{
    double g[3] = { 0 };
    for (int n = 0; n < at->cell.edge * at->cell.edge * at->cell.edge; n++)
        for (int a = 0; a < 3; a++)
            g[a] += at->weights[n] * at->cell.voxels[n]->gradient[a];
    return trip_v3(g[0], g[1], g[2]);
}

/* Lights the colour of a segment at its middle. */
static void light(const passage *p, const position ends[2], trip_vec3 middle, double rgb[3])
{
    const trip_reference_sheets *s = p->s;
    const trip_frame *frame = s->frame;
    const trip_settings *settings = frame->settings;
    const trip_light at = trip_light_at(settings, frame->camera, s->gradient_full, middle);
    if (!settings->shading) {
        trip_effects_colour(&s->effects, &at, middle, NULL, rgb);
        return;
    }
    trip_vec3 codes = trip_scale(trip_add(gradient_at(&ends[0]), gradient_at(&ends[1])), 0.5);
    trip_vec3 g = trip_affine_transpose_vector(&s->to_index, trip_scale(codes, s->value_per_code));
    trip_effects_colour(&s->effects, &at, middle, (double[3]){ g.x, g.y, g.z }, rgb);
}

/* Composites a fragment. Returns false once the pixel takes no more. */
static bool composite(const trip_reference_sheets *s, double layer[TRIP_CHANNELS_MAX],
                      const double fragment[TRIP_CHANNELS_MAX], double alpha)
{
    double through = 1 - layer[TRIP_CHANNEL_ALPHA];
    for (int c = 0; c < TRIP_CHANNELS_MAX; c++)
        layer[c] += fragment[c] * alpha * through;
    double opacity = layer[TRIP_CHANNEL_ALPHA];
    if (!(1 - opacity < s->early_termination))
        return true;
    for (int c = 0; c < TRIP_CHANNELS_MAX; c++)
        layer[c] /= opacity;
    return false;
}

/* Returns the code at t, linear between the two ends of a segment. */
static double code_at(const position ends[2], double t0, double t1, double t)
{
    double a = ends[0].code, b = ends[1].code;
    return t == t0 ? a : t == t1 ? b : a + (b - a) * ((t - t0) / (t1 - t0));
}

/* Classifies a part of a segment with the code from `a` to `b`. */
static trip_segment classify(const trip_reference_sheets *s, const position ends[2], double a,
                             double b)
{
    const double deviation = 0.5 * (ends[0].deviation + ends[1].deviation);
    return s->deviations ? trip_blurred_segment_of(&s->blurred, &s->segments, a, b, deviation)
                         : trip_segment_of(&s->segments, a, b);
}

/* Adds the part of a ray between `from` and `to` with the code from `a` to `b`. Returns false once
 * the pixel takes no more. */
static bool add_part(passage *p, const position ends[2], double a, double b, double from, double to)
{
    trip_segment segment = classify(p->s, ends, a, b);
    double own[3];
    if (!(segment.extinction > 0))
        return true;
    double t = 0.5 * (from + to);
    if (trip_debug_view_of(p->s->frame->settings, p->axis, p->s->frame->plan->level, own))
        memcpy(segment.rgb, own, sizeof own);
    if (p->s->frame->settings->shading || trip_effects_some(&p->s->frame->settings->effects))
        light(p, ends, point_at(p, t), segment.rgb);
    const double fragment[TRIP_CHANNELS_MAX] = {
        [TRIP_CHANNEL_RED] = segment.rgb[0],       [TRIP_CHANNEL_GREEN] = segment.rgb[1],
        [TRIP_CHANNEL_BLUE] = segment.rgb[2],      [TRIP_CHANNEL_ALPHA] = 1,
        [TRIP_CHANNEL_DEPTH] = t * p->world_per_t,
    };
    return composite(p->s, p->layer, fragment,
                     -expm1(-segment.extinction * (to - from) * p->world_per_t));
}

/* Returns where the ray leaves the box that it is in behind t, along an axis. The faces of boxes
 * lie half-way between voxels. */
static double next_face(const passage *p, int axis, double t)
{
    const trip_coordinates *c = p->s->coordinates;
    const double o = trip_component(p->origin, axis), d = trip_component(p->direction, axis);
    const double step = d > 0 ? 1 : -1;
    if (d == 0)
        return INFINITY;
    double face = step * (floor(step * trip_coordinates_index(c, axis, o + t * d) + 0.5) + 0.5);
    double at = (trip_coordinates_position(c, axis, face) - o) / d;
    return at > t ? at : (trip_coordinates_position(c, axis, face + step) - o) / d;
}

/* Adds a segment with the nearest value, box by box. */
static bool add_boxes(passage *p, double middle, int64_t cells, double from, double to)
{
    position ends[2];
    while (from < to) {
        double next = to;
        for (int a = 0; a < 3; a++)
            next = a == p->axis ? next : fmin(next, next_face(p, a, from));
        if (find_position(p, middle, from + TRIP_SHEET_BOX_POINT * (next - from), cells,
                          &ends[0])) {
            ends[1] = ends[0];
            if (!add_part(p, ends, ends[0].code, ends[0].code, from, next))
                return false;
        }
        from = next;
    }
    return true;
}

/* Adds the segment between two coordinates. Returns false once the pixel takes no more. */
static bool add_segment(passage *p, double first, double last, int64_t cells)
{
    position ends[2];
    const double t0 = reached_at(p, first), t1 = reached_at(p, last);
    const double from = fmax(t0, p->from), to = fmin(t1, p->to);
    if (!(from < to))
        return true;
    if (p->s->nearest)
        return add_boxes(p, 0.5 * (first + last), cells, from, to);
    if (!find_position(p, first, t0, cells, &ends[0]) ||
        !find_position(p, last, t1, cells, &ends[1]))
        return true;
    return add_part(p, ends, code_at(ends, t0, t1, from), code_at(ends, t0, t1, to), from, to);
}

/* Cuts the ray at the sides of the grid. */
static void cut_at_sides(passage *p)
{
    const trip_coordinates *c = p->s->coordinates;
    for (int a = 0; a < 3; a++) {
        const double o = trip_component(p->origin, a), d = trip_component(p->direction, a);
        const double lo = trip_coordinates_at(c, a, 0) - o;
        const double hi = trip_coordinates_at(c, a, trip_field_dims(p->s->field)[a] - 1) - o;
        if (a == p->axis)
            continue;
        if (d == 0 && (lo > 0 || hi < 0))
            p->to = -INFINITY;
        if (d != 0) {
            p->from = fmax(p->from, fmin(lo / d, hi / d));
            p->to = fmin(p->to, fmax(lo / d, hi / d));
        }
    }
}

/* Adds all segments in front of the eye. They lie between coordinates n / samples_per_sheet, and
 * between the eye itself and the first such coordinate. */
static void add_segments(passage *p)
{
    const double samples_per_sheet = p->s->frame->settings->samples_per_sheet;
    const double top = (double)trip_field_dims(p->s->field)[p->axis] - 1;
    const double o =
        trip_coordinates_index(p->s->coordinates, p->axis, trip_component(p->origin, p->axis));
    const double d = trip_component(p->direction, p->axis);
    const double step = d > 0 ? 1 : -1, last = d > 0 ? top * samples_per_sheet : 0;
    double n = d > 0 ? fmax(0, ceil(o * samples_per_sheet))
                     : fmin(top * samples_per_sheet, floor(o * samples_per_sheet));
    bool eye_within = !p->s->frame->camera->ortho && o > 0 && o < top;
    double from = eye_within ? o : n / samples_per_sheet;
    for (; (last - n) * step >= 0; n += step) {
        double to = n / samples_per_sheet;
        int64_t cells = (int64_t)fmin(floor(0.5 * (from + to)), top - 1);
        if (from != to && !add_segment(p, from, to, cells))
            return;
        from = to;
    }
}

void trip_reference_sheets_layer(const trip_reference_sheets *s, int axis, int x, int y,
                                 double layer[TRIP_CHANNELS_MAX])
{
    const trip_camera *c = s->frame->camera;
    passage p = {
        .s = s,
        .axis = axis,
        .origin = c->eye,
        .direction = trip_camera_ray(c, x + 0.5, y + 0.5),
        .world_per_t = trip_camera_ray_length(c, x + 0.5, y + 0.5),
        .from = -INFINITY,
        .to = INFINITY,
    };
    if (c->ortho)
        p.origin =
            trip_add(c->eye, trip_add(trip_scale(c->rx, x + 0.5), trip_scale(c->ry, y + 0.5)));
    if (trip_clip_ray(&s->frame->plan->clip, p.origin, p.direction, &p.from, &p.to)) {
        cut_at_sides(&p);
        add_segments(&p);
    }
    memcpy(layer, p.layer, sizeof p.layer);
}
