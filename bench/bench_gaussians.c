/* bench orders, for a Gaussian scene. Measures the time of a frame in each order. Then it compares
 * presorted lists with a sort of all centres in each frame, from small to large scenes. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <triptych.h>

#include "bench_tables.h"
#include "clock.h"
#include "draw_settings.h"
#include "gaussian_frame.h"
#include "gaussian_keys.h"
#include "gaussians_cpu.h"
#include "key_sort.h"
#include "median.h"
#include "renderer.h"
#include "report.h"
#include "weight.h"

enum { ORDERS = 4, INTEGRAL = 3, PARTS = 7, WAYS = 3, REPEAT_MAX = 1000, BATCH = 4096 };

static const char *const order_names[ORDERS] = { "depth", "lists", "sheets", "integral" };

static const measure_column order_columns[] = {
    { "order", "order", 0, 0 },
    { "ms", "median ms", 1, 0 },
    { "times_depth", "x depth", 2, 0 },
    { "gaussians", "Gaussians read", 0, 0 },
    { "gaussians_per_second", "millions a second", 2, 1e6 },
    { "bytes_read", "MB read", 2, 1e6 },
    { "runs", "runs", 0, 0 },
};

static const measure_column sort_columns[] = {
    { "gaussians", "Gaussians", 0, 0 },      { "sort_ms", "sort: ms", 2, 0 },
    { "sorting_ms", "of it sorting", 2, 0 }, { "depth_ms", "depth: ms", 2, 0 },
    { "lists_ms", "lists: ms", 2, 0 },       { "depth_speed", "sort / depth", 2, 0 },
    { "lists_speed", "sort / lists", 2, 0 }, { "same", "same picture", 0, 0 },
};

/* ---- frames of the library ---- */

static int open_context(triptych **t, const bench_options *o, triptych_renderer renderer)
{
    const triptych_resources resources = { .memory_bytes = o->memory_bytes,
                                           .threads = (unsigned)o->threads[0],
                                           .renderer = renderer };
    const triptych_view view = { .width = o->sizes[0][0], .height = o->sizes[0][1] };
    if (triptych_create(t))
        return trip_fail(TRIP_ERROR, "bench", o->input, "out of memory");
    int status = triptych_open(*t, o->input, &resources);
    if (!status)
        status = triptych_set_view(*t, &view);
    if (status)
        trip_report_line(triptych_error(*t));
    return status;
}

/* Draws a frame and takes its statistics. */
static int draw(triptych *t, int order, float *rgba, triptych_frame_stats *stats)
{
    const draw_settings s = { .scene.order = order < INTEGRAL
                                                 ? TRIPTYCH_ORDER_DEPTH + (triptych_order)order
                                                 : TRIPTYCH_ORDER_DEFAULT };
    int status = draw_settings_use(t, &s);
    if (!status)
        status = triptych_draw(t, rgba);
    if (!status)
        status = triptych_get_frame_stats(t, stats);
    if (status)
        trip_report_line(triptych_error(t));
    return status;
}

typedef struct order_times {
    double ms[REPEAT_MAX];
    int runs;
    triptych_frame_stats stats;
} order_times;

/* Draws an untimed frame of each order, then timed ones in turns. */
static int time_orders(triptych *t, const bench_options *o, float *rgba, order_times times[ORDERS])
{
    int status = 0;
    for (int run = -1; run < o->repeat; run++)
        for (int order = 0; order < INTEGRAL && !status; order++) {
            order_times *to = &times[order];
            measure_progress_step(o->progress, order_names[order]);
            status = draw(t, order, rgba, &to->stats);
            if (run >= 0)
                to->ms[to->runs++] = to->stats.ms;
        }
    return status;
}

static int time_integral(const bench_options *o, float *rgba, order_times *to)
{
    triptych *t = NULL;
    int status = open_context(&t, o, TRIPTYCH_RENDERER_INTEGRAL);
    measure_progress_step(o->progress, order_names[INTEGRAL]);
    if (!status)
        status = draw(t, INTEGRAL, rgba, &to->stats);
    to->ms[0] = to->stats.ms;
    to->runs = 1;
    triptych_destroy(t);
    return status;
}

static void add_orders(order_times times[ORDERS], bench_report *r)
{
    cJSON *rows = bench_report_table(r, "orders", "Orders", order_columns);
    double depth = 0;
    for (int i = 0; i < ORDERS; i++) {
        cJSON *row = measure_new_row(rows);
        order_times *from = &times[i];
        const double ms = measure_median(from->ms, from->runs);
        depth = i ? depth : ms;
        cJSON_AddStringToObject(row, "order", order_names[i]);
        measure_add(row, { "ms", ms }, { "times_depth", ms / depth },
                    { "gaussians", (double)from->stats.splats },
                    { "gaussians_per_second", (double)from->stats.splats / ms * 1e3 },
                    { "bytes_read", (double)from->stats.bytes_read }, { "runs", from->runs });
    }
}

static int measure_orders(triptych *t, const bench_options *o, float *rgba, bench_report *r)
{
    order_times *times = calloc(ORDERS, sizeof *times);
    if (!times)
        return trip_fail(TRIP_ERROR, "bench", o->input, "out of memory");
    int status = time_orders(t, o, rgba, times);
    if (!status)
        status = time_integral(o, rgba, &times[INTEGRAL]);
    if (!status)
        add_orders(times, r);
    free(times);
    return status;
}

/* ---- a sort in each frame ---- */

typedef struct sorted_scene {
    trip_gaussian_set *set;
    const trip_camera *camera;
    trip_gaussian_settings settings;
    trip_settings weights;
    trip_budget *budget;
    trip_task_runner runner;
    int axis;
    size_t count;
    trip_gaussian *gaussians;
    trip_key *keys, *scratch;
    trip_gaussian *batch;
} sorted_scene;

#define RESIDENT(X)                                                                                \
    X(s->gaussians, s->count * sizeof *s->gaussians)                                               \
    X(s->keys, s->count * sizeof *s->keys)                                                         \
    X(s->scratch, s->count * sizeof *s->scratch)                                                   \
    X(s->batch, BATCH * sizeof *s->batch)

static void drop_resident(sorted_scene *s)
{
#define RELEASE(field, size) trip_budget_release(s->budget, field, size), field = NULL;
    RESIDENT(RELEASE)
#undef RELEASE
}

static bool take_resident(sorted_scene *s)
{
    bool all = true;
#define TAKE(field, size) all = all && (field = trip_budget_take(s->budget, size)) != NULL;
    RESIDENT(TAKE)
#undef TAKE
    return all;
}

static int fill_resident(sorted_scene *s, trip_gaussian_stream *stream)
{
    int status = 0;
    size_t at = 0, got = 1;
    while (!status && got > 0) {
        status = trip_gaussian_stream_next(stream, s->gaussians + at, NULL, s->count - at, &got);
        at += status ? 0 : got;
    }
    return status;
}

/* Reads all Gaussians of the scene, as a viewer does that keeps them in memory. Sets *fits to false
 * if the memory is too small. */
static int read_all(sorted_scene *s, bool *fits)
{
    trip_gaussian_stream *stream = NULL;
    const trip_gaussian_stream_params params = {
        .axis = s->axis,
        .key = trip_gaussian_key_of_list(s->camera, s->axis, 1),
        .degree = s->settings.degree,
    };
    int status = trip_gaussian_stream_open(&stream, s->set, &params, s->budget);
    if (status)
        return status;
    s->count = trip_gaussian_stream_planned(stream)->records;
    *fits = take_resident(s);
    if (*fits)
        status = fill_resident(s, stream);
    trip_gaussian_stream_close(stream);
    return status;
}

/* Sorts all centres by their view depth. */
static void sort_all(sorted_scene *s)
{
    const trip_gaussian_key depth = trip_gaussian_key_of_depth(s->camera);
    for (size_t i = 0; i < s->count; i++)
        s->keys[i] =
            (trip_key){ trip_key_of(trip_gaussian_key_of(&depth, s->gaussians[i].centre)), i };
    trip_key_sort(s->keys, s->scratch, s->count);
}

static int add_sorted(sorted_scene *s, trip_gaussians_cpu *g)
{
    int status = 0;
    for (size_t at = 0, n; at < s->count && !status; at += n) {
        n = s->count - at < BATCH ? s->count - at : BATCH;
        for (size_t i = 0; i < n; i++)
            s->batch[i] = s->gaussians[s->keys[at + i].number];
        status = trip_gaussians_cpu_add(g, s->batch, n);
        if (!trip_gaussians_cpu_open_tiles(g))
            break;
    }
    return status;
}

/* Draws a frame that sorts all centres. */
static int draw_sorted(sorted_scene *s, float *rgba, double *ms, double *sorting_ms)
{
    const double begun = trip_now_ms();
    trip_gaussians_cpu *g;
    int status =
        trip_gaussians_cpu_begin(&g, &(trip_gaussians_cpu_params){ .camera = s->camera,
                                                                   .settings = &s->settings,
                                                                   .budget = s->budget,
                                                                   .runner = &s->runner });
    if (status)
        return status;
    const double sorts = trip_now_ms();
    sort_all(s);
    *sorting_ms = trip_now_ms() - sorts;
    status = add_sorted(s, g);
    if (!status)
        status = trip_gaussians_cpu_picture(g, rgba, NULL);
    trip_gaussians_cpu_end(g);
    *ms = trip_now_ms() - begun;
    return status;
}

/* Draws a frame from presorted bricks. */
static int draw_presorted(const sorted_scene *s, bool lists, float *rgba, double *ms)
{
    const double begun = trip_now_ms();
    trip_gaussian_frame *f;
    trip_placed_set placed = { .set = s->set };
    static const double unmoved[3][4] = { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } };
    trip_gaussian_transform_make(&placed.placement, unmoved);
    const trip_gaussian_frame_params params = {
        .sets = &placed,
        .set_count = 1,
        .camera = s->camera,
        .settings = s->settings,
        .by_lists = lists ? &s->weights : NULL,
        .budget = s->budget,
        .runner = s->runner,
    };
    int status = trip_gaussian_frame_begin(&f, &params);
    if (status)
        return status;
    do
        status = trip_gaussian_frame_step(f, UINT64_MAX);
    while (status == TRIP_FRAME_MORE);
    if (!status)
        status = trip_gaussian_frame_picture(f, rgba, NULL);
    trip_gaussian_frame_end(f);
    *ms = trip_now_ms() - begun;
    return status;
}

/* Times the three ways in turn, `repeat` times each. */
static int time_ways(sorted_scene *s, const bench_options *o, float *pictures[2], double *ms,
                     double *sorting, bool *same)
{
    const size_t bytes = 4 * (size_t)s->camera->width * (size_t)s->camera->height * sizeof(float);
    double once[2];
    int status = draw_sorted(s, pictures[0], &once[0], &once[1]);
    *same = true;
    for (int i = 0; i < o->repeat && !status; i++) {
        measure_progress_step(o->progress, "sort and lists");
        status = draw_sorted(s, pictures[0], &ms[i], &sorting[i]);
        if (!status)
            status = draw_presorted(s, false, pictures[1], &ms[o->repeat + i]);
        *same &= !memcmp(pictures[0], pictures[1], bytes);
        if (!status)
            status = draw_presorted(s, true, pictures[1], &ms[2 * o->repeat + i]);
    }
    return status;
}

/* Adds a row about a part of the scene. Sets *fits to false if the part exceeds the memory. */
static int measure_part(sorted_scene *s, const bench_options *o, float *pictures[2], cJSON *rows,
                        bool *fits)
{
    double *ms = calloc((size_t)(WAYS + 1) * (size_t)o->repeat, sizeof *ms);
    double *sorting = ms + WAYS * o->repeat;
    bool same;
    int status = ms ? read_all(s, fits) : trip_fail(TRIP_ERROR, "bench", o->input, "out of memory");
    if (!status && *fits)
        status = time_ways(s, o, pictures, ms, sorting, &same);
    if (!status && *fits) {
        double median[WAYS];
        for (int i = 0; i < WAYS; i++)
            median[i] = measure_median(ms + i * o->repeat, o->repeat);
        cJSON *row = measure_new_row(rows);
        measure_add(row, { "gaussians", (double)s->count }, { "sort_ms", median[0] },
                    { "sorting_ms", measure_median(sorting, o->repeat) }, { "depth_ms", median[1] },
                    { "lists_ms", median[2] }, { "depth_speed", median[0] / median[1] },
                    { "lists_speed", median[0] / median[2] });
        cJSON_AddStringToObject(row, "same", same ? "yes" : "no");
    }
    drop_resident(s);
    free(ms);
    return status;
}

static int make_camera(triptych *t, trip_camera *camera)
{
    const trip_affine identity = trip_affine_identity();
    triptych_camera c;
    if (triptych_get_camera(t, &c))
        return trip_report_line(triptych_error(t)), TRIP_ERROR;
    const trip_camera_params params = {
        .eye = trip_v3(c.eye[0], c.eye[1], c.eye[2]),
        .look = trip_v3(c.look[0], c.look[1], c.look[2]),
        .up = trip_v3(c.up[0], c.up[1], c.up[2]),
        .fov_degrees = c.fov_degrees,
        .ortho_height = c.ortho_height,
        .width = c.width,
        .height = c.height,
    };
    return trip_camera_make(camera, &params, &identity);
}

/* Returns the bricks of a node in part number i. The last part is the whole scene. */
static uint32_t bricks_of(uint32_t bricks, int i)
{
    return bricks ? ((bricks - 1) >> (PARTS - 1 - i)) + 1 : 0;
}

/* Leaves the first bricks of each node. Returns whether this differs from the part before. */
static bool keep_part(trip_file_gaussian_node *nodes, const trip_gaussian_set *whole, int axis,
                      int i)
{
    bool more = i == 0;
    for (uint64_t n = 0; n < whole->header.node_count; n++) {
        nodes[n] = whole->nodes[n];
        for (int a = 0; a < 3; a++)
            nodes[n].brick_count[a] = bricks_of(whole->nodes[n].brick_count[a], i);
        more |=
            i && nodes[n].brick_count[axis] != bricks_of(whole->nodes[n].brick_count[axis], i - 1);
    }
    return more;
}

/* Measures a 64th of the scene's bricks, twice as many, and so on. */
static int measure_parts(const sorted_scene *whole, const bench_options *o, float *pictures[2],
                         bench_report *r)
{
    cJSON *rows = bench_report_table(r, "sort", "A sort of all centres in each frame, and lists",
                                     sort_columns);
    trip_file_gaussian_node *nodes = malloc(whole->set->header.node_count * sizeof *nodes);
    int status = nodes ? 0 : trip_fail(TRIP_ERROR, "bench", o->input, "out of memory");
    bool fits = true;
    for (int i = 0; i < PARTS && !status && fits; i++) {
        trip_gaussian_set set = *whole->set;
        sorted_scene s = *whole;
        s.set = &set;
        set.nodes = nodes;
        if (keep_part(nodes, whole->set, s.axis, i))
            status = measure_part(&s, o, pictures, rows, &fits);
        else
            measure_progress_expect(o->progress, -o->repeat);
    }
    if (!fits)
        bench_report_limit(r, "sort: larger parts of the scene exceed the memory.");
    free(nodes);
    return status;
}

static int measure_sorting(triptych *t, const bench_options *o, float *pictures[2], bench_report *r)
{
    trip_camera camera;
    trip_budget *budget = NULL;
    trip_gaussian_set *set = NULL;
    trip_renderer *cpu = NULL; /* lends its threads */
    int status = make_camera(t, &camera);
    if (!status)
        status = trip_budget_create(&budget, o->memory_bytes);
    if (!status)
        status = trip_gaussian_set_open(&set, o->input, budget);
    if (!status)
        status = trip_cpu_create(&cpu, budget, (unsigned)o->threads[0]);
    if (!status) {
        sorted_scene s = {
            .set = set,
            .camera = &camera,
            .settings = { .degree = (int)set->header.degree,
                          .antialiased = set->header.flags & TRIP_GAUSSIAN_ANTIALIASED,
                          .background = { 0, 0, 0, 1 } },
            .weights = trip_settings_default(),
            .budget = budget,
            .runner = trip_renderer_runner(cpu),
            .axis = trip_weight_axis_of_view(&camera),
        };
        s.weights.classify = TRIP_CLASSIFY_PRE;
        status = measure_parts(&s, o, pictures, r);
    }
    if (cpu)
        cpu->ops->destroy(cpu);
    trip_gaussian_set_close(set);
    trip_budget_destroy(budget);
    return status;
}

/* ---- the table ---- */

static void describe(const bench_options *o, triptych *t, bench_report *r)
{
    triptych_scene scene;
    if (triptych_get_scene(t, &scene))
        return;
    cJSON_AddStringToObject(r->settings, "data_set", o->input);
    cJSON_AddNumberToObject(r->settings, "gaussians", (double)scene.gaussians);
    cJSON_AddNumberToObject(r->settings, "degree", scene.degree);
    bench_report_add_size(r->settings, o->sizes[0]);
    cJSON_AddNumberToObject(r->settings, "repeat", o->repeat);
    bench_report_limit(r,
                       "A frame is the default view of `triptych render`. Its bytes come from "
                       "the system's cache, after an untimed frame. Orders take turns, and times "
                       "are medians. The integral is drawn once.");
    bench_report_limit(r, "lists and sheets draw up to three lists, so they read a Gaussian up to "
                          "three times.");
    bench_report_limit(
        r, "sort: all Gaussians stay in memory, decoded. A frame computes the depths of all "
           "centres, sorts them (radix sort) and draws in that order. depth and "
           "lists read presorted bricks from files instead. Rows take the first "
           "bricks of each node.");
}

int bench_gaussians(const bench_options *o, bench_report *r)
{
    const size_t floats = 4 * (size_t)o->sizes[0][0] * (size_t)o->sizes[0][1];
    float *pictures[2] = { malloc(floats * sizeof(float)), malloc(floats * sizeof(float)) };
    triptych *t = NULL;
    int status = pictures[0] && pictures[1]
                     ? open_context(&t, o, TRIPTYCH_RENDERER_CPU)
                     : trip_fail(TRIP_ERROR, "bench", o->input, "out of memory");
    measure_progress_expect(o->progress, INTEGRAL * (o->repeat + 1) + 1 + PARTS * o->repeat);
    if (!status)
        describe(o, t, r);
    if (!status)
        status = measure_orders(t, o, pictures[0], r);
    if (!status)
        status = measure_sorting(t, o, pictures, r);
    triptych_destroy(t);
    free(pictures[0]);
    free(pictures[1]);
    return status;
}
