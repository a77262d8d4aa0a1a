#include "gaussian_frame.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "clock.h"
#include "debug_view.h"
#include "gaussian_footprint.h"
#include "gaussian_integral.h"
#include "gaussian_keys.h"
#include "gaussian_sheet_frame.h"
#include "gaussians_cpu.h"
#include "gaussians_reference.h"
#include "list_colours.h"
#include "normalise.h"
#include "renderer.h"
#include "report.h"
#include "surfel_light.h"
#include "weight.h"

enum { BATCH = 1024, LAYERS_MAX = 3, WAYS = 2 };

/* One stream and its next Gaussians. */
typedef struct source {
    trip_placed_stream *stream;
    trip_gaussian *batch;
    double *keys;
    size_t at, count;
} source;

/* One of the two is not NULL. */
typedef struct layer {
    int axis;
    trip_gaussians_cpu *cpu;
    trip_gaussians_reference *reference;
} layer;

struct trip_gaussian_frame {
    trip_gaussian_frame_params params;
    /* Draw the frame if they are not NULL. */
    trip_gaussian_integral *integral;
    trip_gaussian_sheet_frame *sheets;
    trip_surfel_frame *surfels;
    trip_settings weights; /* of the order by lists */
    int axis_of_view;
    layer layers[LAYERS_MAX];
    unsigned layer_count, drawn; /* layers; those that are complete */
    source sources[WAYS];
    unsigned source_count;       /* of the layer that is drawn; 0 until its streams are open */
    uint64_t planned, seen;      /* Gaussians in the streams of this layer; those drawn */
    trip_gaussian *batch;        /* in order, of all sources */
    double stop;                 /* the order by depth pauses at this key */
    bool paused;                 /* the next Gaussian has a key from `stop` on */
    float *picture;              /* of one layer, with distances behind it; NULL for one layer */
    trip_gaussian_progress read; /* for complete layers */
    trip_gaussian_frame_stats stats;
};

/* ---- memory ---- */

static size_t pixels_of(const trip_gaussian_frame *f)
{
    return (size_t)f->params.camera->width * (size_t)f->params.camera->height;
}

#define BATCH_BYTES (BATCH * sizeof(trip_gaussian))
#define KEYS_BYTES (BATCH * sizeof(double))

static size_t picture_bytes(const trip_gaussian_frame *f)
{
    return pixels_of(f) * (f->params.settings.depth ? 5 : 4) * sizeof(float);
}

static bool take_memory(trip_gaussian_frame *f)
{
    trip_budget *budget = f->params.budget;
    bool all = (f->batch = trip_budget_take(budget, BATCH_BYTES)) != NULL;
    for (int i = 0; i < (f->params.by_lists ? WAYS : 1) && all; i++) {
        source *s = &f->sources[i];
        all = (s->batch = trip_budget_take(budget, BATCH_BYTES)) != NULL &&
              (s->keys = trip_budget_take(budget, KEYS_BYTES)) != NULL;
    }
    if (all && f->params.by_lists)
        all = (f->picture = trip_budget_take(budget, picture_bytes(f))) != NULL;
    return all;
}

/* ---- layers ---- */

static int begin_layer(trip_gaussian_frame *f, layer *l)
{
    const trip_gaussian_frame_params *p = &f->params;
    trip_gaussian_settings settings = p->settings;
    if (p->by_lists)
        settings.background[3] = 0; /* it comes behind the merged layers */
    if (p->reference)
        return trip_gaussians_reference_begin(&l->reference, p->camera, &settings, p->budget);
    return trip_gaussians_cpu_begin(&l->cpu, &(trip_gaussians_cpu_params){
                                                 .camera = p->camera,
                                                 .settings = &settings,
                                                 .budget = p->budget,
                                                 .runner = &p->runner,
                                                 .device = p->device,
                                             });
}

static int begin_layers(trip_gaussian_frame *f)
{
    const trip_camera *c = f->params.camera;
    int status = 0;
    if (!f->params.by_lists) {
        f->layers[f->layer_count++].axis = trip_weight_axis_of_view(c);
        return begin_layer(f, f->layers);
    }
    for (int axis = 0; axis < LAYERS_MAX && !status; axis++) {
        if (!trip_weight_is_somewhere(&f->weights, c, f->axis_of_view, axis, TRIP_WAY_ANY))
            continue;
        f->layers[f->layer_count].axis = axis;
        status = begin_layer(f, &f->layers[f->layer_count++]);
    }
    return status;
}

static int add_to_layer(layer *l, const trip_gaussian *batch, size_t count)
{
    return l->cpu ? trip_gaussians_cpu_add(l->cpu, batch, count)
                  : trip_gaussians_reference_add(l->reference, batch, count);
}

static int end_layer(layer *l)
{
    return l->cpu ? trip_gaussians_cpu_flush(l->cpu) : 0;
}

static bool is_closed(const layer *l)
{
    return l->cpu && trip_gaussians_cpu_open_tiles(l->cpu) == 0;
}

static int take_layer(const layer *l, float *rgba, float *depth)
{
    if (l->cpu)
        return trip_gaussians_cpu_picture(l->cpu, rgba, depth);
    trip_gaussians_reference_picture(l->reference, rgba, depth);
    return 0;
}

static bool may_change(const void *cpu, const double lo[3], const double hi[3], double deviation)
{
    return trip_gaussians_cpu_needs_box(cpu, lo, hi, deviation);
}

/* ---- streams ---- */

static int open_stream(trip_gaussian_frame *f, const trip_gaussian_stream_params *params)
{
    const trip_gaussian_frame_params *of = &f->params;
    trip_placed_stream **out = &f->sources[f->source_count].stream;
    int status =
        trip_placed_stream_open(out, of->sets, of->set_count, params, of->drawn, of->budget);
    if (status)
        return status;
    const trip_gaussian_plan *plan = trip_placed_stream_planned(*out);
    f->planned += plan->records;
    f->stats.planned += plan->records;
    f->stats.coarse += plan->coarse_records;
    if (plan->window_records > f->stats.window_records)
        f->stats.window_records = plan->window_records;
    f->sources[f->source_count].at = f->sources[f->source_count].count = 0;
    f->source_count++;
    return 0;
}

/* Opens the streams of a layer. In perspective, a list goes outwards from the eye in both
 * directions. */
static int open_streams(trip_gaussian_frame *f, const layer *l)
{
    const trip_camera *c = f->params.camera;
    trip_gaussian_plane planes[TRIP_GAUSSIAN_PLANES_MAX];
    trip_gaussian_stream_params p = {
        .axis = l->axis,
        .planes = planes,
        .plane_count = trip_gaussian_planes_of(c, planes),
        .lod = trip_gaussian_lod_of(c, f->params.lod_px),
        .degree = f->params.settings.degree,
        .need = { l->cpu ? may_change : NULL, l->cpu },
    };
    f->source_count = 0;
    f->planned = f->seen = 0;
    if (!f->params.by_lists) {
        p.key = trip_gaussian_key_of_depth(c);
        return open_stream(f, &p);
    }
    if (c->ortho) {
        p.key = trip_gaussian_key_of_list(c, l->axis,
                                          trip_ray_goes(c->r0, l->axis) == TRIP_WAY_UP ? 1 : -1);
        return open_stream(f, &p);
    }
    p.key_max = DBL_MAX;
    p.key = trip_gaussian_key_of_list(c, l->axis, 1);
    int status = open_stream(f, &p);
    p.key = trip_gaussian_key_of_list(c, l->axis, -1);
    p.key_min = DBL_TRUE_MIN; /* a key of 0 is in the first stream */
    return status ? status : open_stream(f, &p);
}

static void close_streams(trip_gaussian_frame *f)
{
    for (int i = 0; i < WAYS; i++) {
        trip_placed_stream_close(f->sources[i].stream);
        f->sources[i].stream = NULL;
    }
    f->source_count = 0;
}

/* A Gaussian of a coarse level blocks the same light as without the low-pass filter. Its opacity
 * above 1/255 counts, since drawing leaves out the rest. */
static void compensate(const trip_gaussian_frame *f, trip_gaussian *g)
{
    const trip_gaussian_settings *s = &f->params.settings;
    const float least = (float)TRIP_GAUSSIAN_ALPHA_MIN;
    if (g->merged && g->opacity > least && !s->antialiased && !g->antialiased &&
        s->shape != TRIP_GAUSSIAN_EWA)
        g->opacity =
            least + (g->opacity - least) * (float)trip_gaussian_compensation(f->params.camera, g);
}

static int fill(const trip_gaussian_frame *f, source *s)
{
    s->at = s->count = 0;
    const int status = trip_placed_stream_next(s->stream, s->batch, s->keys, BATCH, &s->count);
    for (size_t i = 0; i < s->count; i++)
        compensate(f, &s->batch[i]);
    trip_surfel_light(f->params.settings.light, f->params.camera, s->batch, s->count);
    if (f->params.by_lists)
        trip_list_colours(&f->weights, f->layers[f->drawn].axis, s->batch, s->count);
    return status;
}

static bool has_any(const source *s)
{
    return s->at < s->count;
}

/* Takes the next Gaussians of all sources in the order of their keys. */
static int take_batch(trip_gaussian_frame *f, const trip_gaussian **batch, size_t *count)
{
    const double begun = trip_now_ms();
    source *a = &f->sources[0], *b = &f->sources[1];
    int status = has_any(a) ? 0 : fill(f, a);
    if (!status && f->source_count > 1 && !has_any(b))
        status = fill(f, b);
    if (status || f->source_count == 1) {
        const size_t first = a->at;
        while (!status && has_any(a) && a->keys[a->at] < f->stop)
            a->at++;
        *batch = a->batch + first;
        *count = a->at - first;
        f->paused = !status && !*count && has_any(a);
    } else {
        *batch = f->batch;
        *count = 0;
        while (*count < BATCH && (has_any(a) || has_any(b))) {
            source *next = !has_any(b) || (has_any(a) && a->keys[a->at] <= b->keys[b->at]) ? a : b;
            f->batch[(*count)++] = next->batch[next->at++];
            if (!has_any(next))
                break; /* the next one of this source may come first */
        }
    }
    f->stats.read_ms += trip_now_ms() - begun;
    return status;
}

/* ---- the integral ---- */

static int begin_integral(trip_gaussian_frame *f)
{
    const trip_gaussian_frame_params *p = &f->params;
    return trip_gaussian_integral_begin(&f->integral, &(trip_gaussian_integral_params){
                                                          .sets = p->sets,
                                                          .set_count = p->set_count,
                                                          .drawn = p->drawn,
                                                          .camera = p->camera,
                                                          .settings = p->settings,
                                                          .tolerance = p->tolerance,
                                                          .budget = p->budget,
                                                          .runner = p->runner,
                                                      });
}

static trip_gaussian_frame_stats stats_of_integral(const trip_gaussian_frame *f)
{
    const trip_gaussian_integral_stats s = trip_gaussian_integral_get_stats(f->integral);
    return (trip_gaussian_frame_stats){
        .gaussians = s.gaussians,
        .bricks = s.bricks,
        .bytes_read = s.bytes_read,
        .window_records = s.window_records,
        .draw_ms = s.draw_ms,
        .read_ms = s.read_ms,
        .merge_ms = f->stats.merge_ms,
    };
}

/* ---- sheets ---- */

static int begin_sheets(trip_gaussian_frame *f)
{
    const trip_gaussian_frame_params *p = &f->params;
    return trip_gaussian_sheet_frame_begin(&f->sheets, &(trip_gaussian_sheet_frame_params){
                                                           .placed = p->sets,
                                                           .camera = p->camera,
                                                           .settings = p->settings,
                                                           .weights = &f->weights,
                                                           .thickness = p->sheet,
                                                           .reference = p->reference,
                                                           .budget = p->budget,
                                                           .runner = p->runner,
                                                       });
}

static trip_gaussian_frame_stats stats_of_sheets(const trip_gaussian_frame *f)
{
    const trip_gaussian_sheet_frame_stats s = trip_gaussian_sheet_frame_get_stats(f->sheets);
    return (trip_gaussian_frame_stats){
        .gaussians = s.gaussians,
        .bricks = s.bricks,
        .bytes_read = s.bytes_read,
        .window_records = s.held_records,
        .layers = s.passes,
        .draw_ms = s.draw_ms,
        .read_ms = s.read_ms,
        .merge_ms = f->stats.merge_ms,
    };
}

/* ---- deferred ---- */

static int begin_surfels(trip_gaussian_frame *f)
{
    const trip_gaussian_frame_params *p = &f->params;
    return trip_surfel_frame_begin(&f->surfels,
                                   &(trip_surfel_frame_params){ .sets = p->sets,
                                                                .set_count = p->set_count,
                                                                .drawn = p->drawn,
                                                                .camera = p->camera,
                                                                .settings = p->settings,
                                                                .lod_px = p->lod_px,
                                                                .reference = p->reference,
                                                                .history = p->history,
                                                                .device = p->surfel_device,
                                                                .budget = p->budget,
                                                                .runner = p->runner });
}

static trip_gaussian_frame_stats stats_of_surfels(const trip_gaussian_frame *f)
{
    const trip_surfel_frame_stats s = trip_surfel_frame_get_stats(f->surfels);
    return (trip_gaussian_frame_stats){
        .gaussians = s.read,
        .planned = s.planned,
        .coarse = s.coarse,
        .bricks = s.bricks,
        .bytes_read = s.bytes_read,
        .surfels = s,
        .layers = 1,
        .done = s.done,
        .draw_ms = s.project_ms,
        .read_ms = s.read_ms,
        .merge_ms = s.blend_ms,
    };
}

/* ---- the frame ---- */

/* The weights of the lists need no Gaussians. */
static bool shows_weights(const trip_gaussian_frame *f)
{
    return f->params.by_lists && f->weights.show == TRIP_SHOW_MERGE;
}

static void fill_with_weights(const trip_gaussian_frame *f, float *rgba)
{
    const trip_camera *c = f->params.camera;
    for (int y = 0; y < c->height; y++)
        for (int x = 0; x < c->width; x++, rgba += 4) {
            double rgb[3];
            trip_debug_view_merge(&f->weights, c, f->axis_of_view, x + 0.5, y + 0.5, rgb);
            for (int i = 0; i < 3; i++)
                rgba[i] = (float)rgb[i];
            rgba[3] = 1;
        }
}

static int begin_layers_and_streams(trip_gaussian_frame *f)
{
    int status = take_memory(f) ? 0
                                : trip_fail(TRIP_ERROR, "render", "memory",
                                            "the layers do not fit; raise --memory or draw a "
                                            "smaller picture");
    if (!status)
        status = begin_layers(f);
    for (unsigned i = f->layer_count; i-- > 0 && !status;) {
        close_streams(f); /* they showed that their window fits */
        f->stats = (trip_gaussian_frame_stats){ 0 };
        status = open_streams(f, &f->layers[i]);
    }
    f->stats.layers = f->layer_count;
    return status;
}

int trip_gaussian_frame_begin(trip_gaussian_frame **out, const trip_gaussian_frame_params *params)
{
    trip_gaussian_frame *f = *out = trip_budget_take(params->budget, sizeof *f);
    if (!f)
        return trip_fail(TRIP_ERROR, "render", "memory", "the frame does not fit; raise --memory");
    *f = (trip_gaussian_frame){ .params = *params };
    f->axis_of_view = trip_weight_axis_of_view(params->camera);
    if (params->by_lists)
        f->weights = *params->by_lists;
    const int status = shows_weights(f)    ? 0
                       : params->integral  ? begin_integral(f)
                       : params->deferred  ? begin_surfels(f)
                       : params->sheet > 0 ? begin_sheets(f)
                                           : begin_layers_and_streams(f);
    if (!status)
        return 0;
    trip_gaussian_frame_end(f);
    *out = NULL;
    return status;
}

/* Returns the records and bytes read so far, over all layers. */
static trip_gaussian_progress read_by(const trip_gaussian_frame *f)
{
    trip_gaussian_progress sum = f->read;
    for (unsigned i = 0; i < f->source_count; i++) {
        const trip_gaussian_progress one = trip_placed_stream_progress(f->sources[i].stream);
        sum.bricks += one.bricks;
        sum.records += one.records;
        sum.bytes += one.bytes;
        sum.unneeded_records += one.unneeded_records;
    }
    return sum;
}

/* Two streams of a layer plan some bricks twice, and may leave out some of their Gaussians. */
static double share_done(const trip_gaussian_frame *f)
{
    double all = 0;
    for (unsigned i = 0; i < f->params.set_count; i++)
        all += (double)f->params.sets[i].set->header.records;
    const double planned = fmin((double)f->planned, all);
    const double seen = (double)(f->seen + read_by(f).unneeded_records - f->read.unneeded_records);
    const double part = planned > 0 ? fmin(seen / planned, 1) : 0;
    return (f->drawn + part) / f->layer_count;
}

/* Draws one batch. Opens the streams of the next layer once a layer is complete. */
static int draw_batch(trip_gaussian_frame *f)
{
    layer *l = &f->layers[f->drawn];
    const trip_gaussian *batch;
    size_t count = 0;
    int status = f->source_count ? 0 : open_streams(f, l);
    if (!status && !is_closed(l))
        status = take_batch(f, &batch, &count);
    const double begun = trip_now_ms();
    if (!status && count)
        status = add_to_layer(l, batch, count);
    else if (!status)
        status = end_layer(l);
    f->stats.draw_ms += trip_now_ms() - begun;
    f->stats.gaussians += count;
    f->seen += count;
    f->stats.done = share_done(f);
    if (status || count || f->paused)
        return status;
    f->read = read_by(f);
    close_streams(f);
    f->drawn++;
    f->planned = f->seen = 0;
    f->stats.done = share_done(f);
    return 0;
}

int trip_gaussian_frame_step_to(trip_gaussian_frame *f, double depth, uint64_t deadline_ns)
{
    int status = 0;
    if (f->integral)
        return trip_gaussian_integral_step(f->integral, deadline_ns);
    if (f->sheets)
        return trip_gaussian_sheet_frame_step(f->sheets, deadline_ns);
    if (f->surfels)
        return trip_surfel_frame_step(f->surfels, deadline_ns);
    f->stop = depth;
    f->paused = false;
    while (!status && f->drawn < f->layer_count && !f->paused) {
        status = draw_batch(f);
        if (!status)
            status = trip_frame_poll();
        if (!status && f->drawn < f->layer_count && !f->paused && trip_now_ns() >= deadline_ns)
            return TRIP_FRAME_MORE;
    }
    return status ? status : TRIP_FRAME_DONE;
}

int trip_gaussian_frame_step(trip_gaussian_frame *f, uint64_t deadline_ns)
{
    return trip_gaussian_frame_step_to(f, INFINITY, deadline_ns);
}

/* Adds w^2 times a layer to the sums. Distances are weighted by opacity too, as in layer.h. */
static void add_layer(const trip_gaussian_frame *f, const layer *l, float *rgba, float *depth)
{
    const trip_camera *c = f->params.camera;
    const float *from = f->picture;
    size_t pixel = 0; /* distances stand behind the colours */
    for (int y = 0; y < c->height; y++)
        for (int x = 0; x < c->width; x++, from += 4, rgba += 4, pixel++) {
            const trip_vec3 ray = trip_camera_ray(c, x + 0.5, y + 0.5);
            double all = 0;
            for (int axis = 0; axis < LAYERS_MAX; axis++) {
                const double w = trip_weight(&f->weights, f->axis_of_view, ray, axis);
                all += w * w;
            }
            const double w = trip_weight(&f->weights, f->axis_of_view, ray, l->axis);
            const float share = (float)(w * w / all);
            for (int i = 0; i < 4; i++)
                rgba[i] += share * from[i];
            if (depth && share > 0 && from[3] > 0)
                depth[pixel] += share * from[3] * f->picture[4 * pixels_of(f) + pixel];
        }
}

/* Merges the layers drawn so far. */
static int merge(trip_gaussian_frame *f, float *rgba, float *depth)
{
    int status = 0;
    const size_t pixels = pixels_of(f);
    memset(rgba, 0, 4 * pixels * sizeof *rgba);
    if (depth)
        memset(depth, 0, pixels * sizeof *depth);
    for (unsigned i = 0; i < f->layer_count && !status; i++) {
        status = take_layer(&f->layers[i], f->picture, depth ? f->picture + 4 * pixels : NULL);
        if (!status)
            add_layer(f, &f->layers[i], rgba, depth);
    }
    for (size_t i = 0; depth && i < pixels; i++)
        depth[i] = rgba[4 * i + 3] > 0 ? depth[i] / rgba[4 * i + 3] : INFINITY;
    trip_put_behind(rgba, pixels, f->params.settings.background);
    return status;
}

int trip_gaussian_frame_picture(trip_gaussian_frame *f, float *rgba, float *depth)
{
    const double begun = trip_now_ms();
    int status = 0;
    if (shows_weights(f))
        fill_with_weights(f, rgba);
    else if (f->integral)
        trip_gaussian_integral_picture(f->integral, rgba);
    else if (f->sheets)
        trip_gaussian_sheet_frame_picture(f->sheets, rgba, depth);
    else if (f->surfels)
        status = trip_surfel_frame_picture(f->surfels, rgba, depth);
    else
        status = f->params.by_lists ? merge(f, rgba, depth) : take_layer(f->layers, rgba, depth);
    f->stats.merge_ms += trip_now_ms() - begun;
    return status;
}

trip_gaussian_frame_stats trip_gaussian_frame_get_stats(const trip_gaussian_frame *f)
{
    if (f->integral)
        return stats_of_integral(f);
    if (f->sheets)
        return stats_of_sheets(f);
    if (f->surfels)
        return stats_of_surfels(f);
    trip_gaussian_frame_stats stats = f->stats;
    const trip_gaussian_progress read = read_by(f);
    stats.bricks = read.bricks;
    stats.bytes_read = read.bytes;
    return stats;
}

void trip_gaussian_frame_end(trip_gaussian_frame *f)
{
    if (!f)
        return;
    trip_budget *budget = f->params.budget;
    trip_gaussian_integral_end(f->integral);
    trip_gaussian_sheet_frame_end(f->sheets);
    trip_surfel_frame_end(f->surfels);
    close_streams(f);
    for (unsigned i = 0; i < f->layer_count; i++) {
        trip_gaussians_cpu_end(f->layers[i].cpu);
        trip_gaussians_reference_end(f->layers[i].reference);
    }
    for (int i = 0; i < WAYS; i++) {
        trip_budget_release(budget, f->sources[i].batch, BATCH_BYTES);
        trip_budget_release(budget, f->sources[i].keys, KEYS_BYTES);
    }
    trip_budget_release(budget, f->batch, BATCH_BYTES);
    trip_budget_release(budget, f->picture, picture_bytes(f));
    trip_budget_release(budget, f, sizeof *f);
}
