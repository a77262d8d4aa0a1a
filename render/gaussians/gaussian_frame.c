#include "gaussian_frame.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "clock.h"
#include "gaussians_cpu.h"
#include "gaussians_reference.h"
#include "normalise.h"
#include "renderer.h"
#include "report.h"
#include "surfel_light.h"
#include "weight.h"

enum { BATCH = 1024, LAYERS_MAX = 3, WAYS = 2 };

/* One stream and its next Gaussians. */
typedef struct source {
    trip_gaussian_stream *stream;
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
    trip_settings weights; /* of the order by lists */
    trip_settings light;   /* on surfels, if `shading` */
    int axis_of_view;
    layer layers[LAYERS_MAX];
    unsigned layer_count, drawn; /* layers; those that are complete */
    source sources[WAYS];
    unsigned source_count; /* of the layer that is drawn; 0 until its streams are open */
    trip_gaussian *batch;  /* in order, of all sources */
    float *picture;        /* of one layer, with distances behind it; NULL for one layer */
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

static bool is_closed(const layer *l)
{
    return l->cpu && trip_gaussians_cpu_open_tiles(l->cpu) == 0;
}

static void take_layer(const layer *l, float *rgba, float *depth)
{
    if (l->cpu)
        trip_gaussians_cpu_picture(l->cpu, rgba, depth);
    else
        trip_gaussians_reference_picture(l->reference, rgba, depth);
}

/* ---- streams ---- */

static void put(double to[3], trip_vec3 v)
{
    to[0] = v.x;
    to[1] = v.y;
    to[2] = v.z;
}

static trip_gaussian_view view_of(const trip_camera *c)
{
    const trip_camera_params *p = &c->params;
    const trip_vec3 forward = trip_normalize(trip_sub(p->look, p->eye));
    const trip_vec3 right = trip_normalize(trip_cross(forward, p->up));
    const double half = c->ortho ? p->ortho_height / 2 : tan(p->fov_degrees * (M_PI / 360));
    trip_gaussian_view v = {
        .parallel = c->ortho,
        .half_width = half * c->width / c->height,
        .half_height = half,
        .width_px = (unsigned)c->width,
        .height_px = (unsigned)c->height,
    };
    put(v.eye, p->eye);
    put(v.right, right);
    put(v.down, trip_cross(forward, right));
    put(v.forward, forward);
    return v;
}

/* Sets the planes of the view's sides, and the nearest plane that shows a centre. */
static unsigned find_planes(const trip_camera *c, trip_gaussian_plane planes[])
{
    const trip_gaussian_view v = view_of(c);
    trip_gaussian_view_planes(&v, planes);
    trip_gaussian_plane *near = &planes[TRIP_GAUSSIAN_SIDES];
    *near = (trip_gaussian_plane){ .offset = c->ortho ? 0 : -0.99 * TRIP_GAUSSIAN_NEAR };
    for (int a = 0; a < 3; a++) {
        near->normal[a] = v.forward[a];
        near->offset -= v.forward[a] * v.eye[a];
    }
    return TRIP_GAUSSIAN_SIDES + 1;
}

/* The key of a list: the coordinate relative to the eye, in one direction. */
static trip_gaussian_key key_of_list(const trip_camera *c, int axis, int way)
{
    trip_gaussian_key key = { .offset = -way * trip_component(c->eye, axis) };
    key.direction[axis] = way;
    return key;
}

static trip_gaussian_key key_of_depth(const trip_camera *c)
{
    trip_gaussian_key key = { .offset = -trip_dot(c->forward, c->eye) };
    put(key.direction, c->forward);
    return key;
}

static int open_stream(trip_gaussian_frame *f, const trip_gaussian_stream_params *params)
{
    trip_gaussian_stream **out = &f->sources[f->source_count].stream;
    int status = trip_gaussian_stream_open(out, f->params.set, params, f->params.budget);
    if (status)
        return status;
    const trip_gaussian_plan *plan = trip_gaussian_stream_planned(*out);
    f->stats.bricks += plan->bricks;
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
        .plane_count = find_planes(c, planes),
        .degree = f->params.settings.degree,
    };
    f->source_count = 0;
    if (!f->params.by_lists) {
        p.key = key_of_depth(c);
        return open_stream(f, &p);
    }
    if (c->ortho) {
        p.key = key_of_list(c, l->axis, trip_ray_goes(c->r0, l->axis) == TRIP_WAY_UP ? 1 : -1);
        return open_stream(f, &p);
    }
    p.key_max = DBL_MAX;
    p.key = key_of_list(c, l->axis, 1);
    int status = open_stream(f, &p);
    p.key = key_of_list(c, l->axis, -1);
    p.key_min = DBL_TRUE_MIN; /* a key of 0 is in the first stream */
    return status ? status : open_stream(f, &p);
}

static void close_streams(trip_gaussian_frame *f)
{
    for (int i = 0; i < WAYS; i++) {
        trip_gaussian_stream_close(f->sources[i].stream);
        f->sources[i].stream = NULL;
    }
    f->source_count = 0;
}

static int fill(const trip_gaussian_frame *f, source *s)
{
    s->at = s->count = 0;
    const int status = trip_gaussian_stream_next(s->stream, s->batch, s->keys, BATCH, &s->count);
    if (!status && f->light.shading)
        trip_surfel_light(&f->light, f->params.camera, s->batch, s->count);
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
        *batch = a->batch;
        *count = status ? 0 : a->count;
        a->at = a->count;
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

/* ---- the frame ---- */

int trip_gaussian_frame_begin(trip_gaussian_frame **out, const trip_gaussian_frame_params *params)
{
    trip_gaussian_frame *f = *out = trip_budget_take(params->budget, sizeof *f);
    if (!f)
        return trip_fail(TRIP_ERROR, "render", "memory", "the frame does not fit; raise --memory");
    *f = (trip_gaussian_frame){ .params = *params };
    f->axis_of_view = trip_weight_axis_of_view(params->camera);
    if (params->by_lists)
        f->weights = *params->by_lists;
    if (params->light)
        f->light = *params->light;
    int status = take_memory(f) ? 0
                                : trip_fail(TRIP_ERROR, "render", "memory",
                                            "the layers do not fit; raise --memory or draw a "
                                            "smaller picture");
    if (!status)
        status = begin_layers(f);
    if (!status)
        status = open_streams(f, f->layers);
    f->stats.layers = f->layer_count;
    if (!status)
        return 0;
    trip_gaussian_frame_end(f);
    *out = NULL;
    return status;
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
    f->stats.draw_ms += trip_now_ms() - begun;
    f->stats.gaussians += count;
    if (status || count)
        return status;
    for (unsigned i = 0; i < f->source_count; i++)
        f->stats.bytes_read += trip_gaussian_stream_planned(f->sources[i].stream)->read_bytes;
    close_streams(f);
    f->drawn++;
    return 0;
}

int trip_gaussian_frame_step(trip_gaussian_frame *f, uint64_t deadline_ns)
{
    int status = 0;
    while (!status && f->drawn < f->layer_count) {
        status = draw_batch(f);
        if (!status)
            status = trip_frame_poll();
        if (!status && f->drawn < f->layer_count && trip_now_ns() >= deadline_ns)
            return TRIP_FRAME_MORE;
    }
    return status ? status : TRIP_FRAME_DONE;
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
static void merge(trip_gaussian_frame *f, float *rgba, float *depth)
{
    const size_t pixels = pixels_of(f);
    memset(rgba, 0, 4 * pixels * sizeof *rgba);
    if (depth)
        memset(depth, 0, pixels * sizeof *depth);
    for (unsigned i = 0; i < f->layer_count; i++) {
        take_layer(&f->layers[i], f->picture, depth ? f->picture + 4 * pixels : NULL);
        add_layer(f, &f->layers[i], rgba, depth);
    }
    for (size_t i = 0; depth && i < pixels; i++)
        depth[i] = rgba[4 * i + 3] > 0 ? depth[i] / rgba[4 * i + 3] : INFINITY;
    trip_put_behind(rgba, pixels, f->params.settings.background);
}

int trip_gaussian_frame_picture(trip_gaussian_frame *f, float *rgba, float *depth)
{
    const double begun = trip_now_ms();
    if (f->params.by_lists)
        merge(f, rgba, depth);
    else
        take_layer(f->layers, rgba, depth);
    f->stats.merge_ms += trip_now_ms() - begun;
    return 0;
}

trip_gaussian_frame_stats trip_gaussian_frame_get_stats(const trip_gaussian_frame *f)
{
    return f->stats;
}

void trip_gaussian_frame_end(trip_gaussian_frame *f)
{
    if (!f)
        return;
    trip_budget *budget = f->params.budget;
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
