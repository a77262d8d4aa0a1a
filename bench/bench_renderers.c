/* bench renderers: measures frames and splats per second of the available renderers, in views
 * around the object. The first row is the default of `triptych render` (bench_default.c). */
#include "bench_tables.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "bench_probe.h"
#include "bench_view.h"
#include "report.h"
#include "median.h"

enum { MAX_CONTENDERS = BENCH_LIST_MAX * BENCH_LIST_MAX, SAMPLE_EVERY = 16 };

#define COLUMNS_OF_TIMES                                                                           \
    { "name", "drawn", 0, 0 }, { "renderer", "renderer", 0, 0 }, { "threads", "threads", 0, 0 },   \
        { "size", "size, pixels", 0, 0 }, { "ms", "ms: median", 1, 0 },                            \
        { "ms_min", "fastest", 1, 0 }, { "ms_max", "slowest", 1, 0 },                              \
    {                                                                                              \
        "fps", "frames/s", 2, 0                                                                    \
    }
static const measure_column columns[] = { COLUMNS_OF_TIMES };
static const measure_column counted_columns[] = {
    COLUMNS_OF_TIMES,
    { "msplats_per_s", "million splats/s", 2, 0 },
    { "pixels_per_splat", "pixels/splat", 1, 0 },
    { "mpixels_per_s", "million pixels/s", 1, 0 },
};

/* A renderer and its number of threads; 0 means one per processor. */
typedef struct contender {
    trip_renderer *renderer;
    int threads;
    bench_cost *costs; /* of the current size, [view * repeat + run] */
} contender;

/* Splats and pixels to draw in a view, the same for all renderers. */
typedef struct load {
    double splats, pixels;
} load;

typedef struct race {
    const session *session;
    const bench_options *options;
    trip_reader *reader;
    contender contenders[MAX_CONTENDERS];
    int count;
    trip_renderer *occluder; /* renderer of the current frame */
    load *loads;             /* of the current size, [view] */
    trip_camera_params *views;
} race;

static trip_renderer **occluder_of(race *c)
{
    return c->options->draw_occluded ? NULL : &c->occluder;
}

static int add_contender(race *c, trip_renderer_kind kind, int threads, bench_report *r)
{
    static const char *const names[] = { "auto", "gl", "cpu", "reference" };
    contender *own = &c->contenders[c->count];
    char why[256], key[32];
    own->threads = kind == TRIP_RENDERER_CPU ? threads : 0;
    int status = bench_renderer_create(c->session, &own->renderer, kind, threads, false, why);
    if (!status && own->renderer && own->renderer->software && c->options->in_short &&
        !c->options->chosen) {
        bench_renderer_destroy(own->renderer);
        own->renderer = NULL;
        snprintf(why, sizeof why,
                 "no graphics device; `triptych bench --renderer gl` measures gl on "
                 "the processor");
    }
    if (status || !own->renderer) {
        bench_report_limit(r, "left out: %s: %s", names[kind], why);
        return status;
    }
    cJSON *machine = r->machine;
    snprintf(key, sizeof key, "renderer_%s", own->renderer->ops->name);
    if (!cJSON_HasObjectItem(machine, key))
        cJSON_AddStringToObject(machine, key, own->renderer->ops->device(own->renderer));
    own->costs = calloc((size_t)(c->options->views * c->options->repeat), sizeof *own->costs);
    if (!own->costs)
        return trip_fail(TRIP_ERROR, "bench", "runs", "out of memory");
    c->count++;
    return 0;
}

/* Adds each renderer once, and cpu once for each number of threads. */
static int add_contenders(race *c, bench_report *r)
{
    const bench_options *o = c->options;
    int status = 0;
    for (int i = 0; i < o->renderer_count; i++)
        for (int k = 0; k < o->thread_count && !status; k++)
            if (k == 0 || o->renderers[i] == TRIP_RENDERER_CPU)
                status = add_contender(c, o->renderers[i], o->threads[k], r);
    if (!status && c->count == 0)
        return trip_fail(TRIP_ERROR, "bench", "renderers",
                         "none of the selected renderers runs on this machine");
    return status;
}

/* post has no splats to count. */
static bool counts(const race *c)
{
    return !c->options->no_counts && c->options->settings.classify == TRIP_CLASSIFY_PRE;
}

/* Counts splats exactly by the first contender, and pixels by a sample of the footprints. */
static int measure_load(bench_frame frame, load *out)
{
    bench_cost cost;
    bench_probe probe = bench_probe_make(SAMPLE_EVERY);
    int status = bench_frame_draw(&frame, true, &cost);
    out->splats = (double)cost.stats.all.splats_drawn;
    frame.renderer = &probe.base;
    if (!status)
        status = bench_frame_draw(&frame, false, &cost);
    out->pixels = probe.drawn ? out->splats * (double)probe.pixels / (double)probe.drawn : 0;
    return status;
}

/* Each contender's turn begins with an untimed frame. The first frame compiles shaders and enlarges
 * buffers, and threads that slept during other turns have to be distributed over the processors
 * again. */
static int draw_view(race *c, bench_frame frame, int view)
{
    int repeat = c->options->repeat, status = 0;
    frame.renderer = c->contenders[0].renderer;
    if (counts(c))
        status = measure_load(frame, &c->loads[view]);
    for (int i = 0; i < c->count && !status; i++) {
        bench_cost untimed, *costs = &c->contenders[i].costs[view * repeat];
        frame.renderer = c->contenders[i].renderer;
        status = bench_frame_draw(&frame, false, &untimed);
        for (int run = 0; run < repeat && !status; run++)
            status = bench_frame_draw(&frame, false, &costs[run]);
    }
    return status;
}

static int draw_views(race *c, const int size[2])
{
    bench_frame frame = { .session = c->session,
                          .reader = c->reader,
                          .occluder = occluder_of(c),
                          .settings = c->options->settings,
                          .progress = c->options->progress };
    int status = session_take_image(c->session, size[0], size[1], &frame.rgba);
    for (int view = 0; view < c->options->views && !status; view++) {
        frame.view = c->views[view] = bench_view_round(c->session, size, view, c->options->views);
        status = draw_view(c, frame, view);
    }
    session_release_image(c->session, size[0], size[1], frame.rgba);
    return status;
}

static void add_vector(cJSON *object, const char *name, trip_vec3 v)
{
    const double numbers[3] = { v.x, v.y, v.z };
    cJSON_AddItemToObject(object, name, cJSON_CreateDoubleArray(numbers, 3));
}

/* Adds every view and the time of every run, so that other programs can be timed in the same
 * views. */
static void add_views(const race *c, const contender *own, cJSON *row)
{
    int repeat = c->options->repeat;
    cJSON *views = cJSON_AddArrayToObject(row, "each_view");
    for (int i = 0; i < c->options->views; i++) {
        cJSON *view = cJSON_CreateObject(), *runs = cJSON_AddArrayToObject(view, "ms");
        add_vector(view, "eye", c->views[i].eye);
        add_vector(view, "look", c->views[i].look);
        add_vector(view, "up", c->views[i].up);
        cJSON_AddNumberToObject(view, "fov_degrees", c->views[i].fov_degrees);
        for (int run = 0; run < repeat; run++)
            cJSON_AddItemToArray(runs, cJSON_CreateNumber(own->costs[i * repeat + run].ms));
        cJSON_AddItemToArray(views, view);
    }
}

static void add_row(const race *c, const contender *own, const int size[2], double *values,
                    cJSON *rows)
{
    int repeat = c->options->repeat, frames = c->options->views * repeat;
    double ms = 0, splats = 0, pixels = 0;
    for (int i = 0; i < frames; i++) {
        values[i] = own->costs[i].ms;
        ms += own->costs[i].ms;
        splats += c->loads[i / repeat].splats;
        pixels += c->loads[i / repeat].pixels;
    }
    const double median = measure_median(values, frames);
    cJSON *row = measure_new_row(rows);
    cJSON_AddStringToObject(row, "name", bench_classified(&c->options->settings));
    cJSON_AddStringToObject(row, "renderer", own->renderer->ops->name);
    cJSON_AddStringToObject(row, "device", own->renderer->ops->device(own->renderer));
    if (!strcmp(own->renderer->ops->name, "cpu"))
        cJSON_AddNumberToObject(
            row, "threads", own->threads ? own->threads : (double)sysconf(_SC_NPROCESSORS_ONLN));
    bench_report_add_size(row, size);
    measure_add(row, { "views", c->options->views }, { "ms", median }, { "ms_min", values[0] },
                { "ms_max", values[frames - 1] }, { "fps", 1e3 / median });
    if (counts(c)) {
        measure_add(row, { "splats_drawn", splats / frames },
                    { "msplats_per_s", splats / ms * 1e-3 },
                    { "mpixels_per_s", pixels / ms * 1e-3 });
    }
    if (splats > 0)
        cJSON_AddNumberToObject(row, "pixels_per_splat", pixels / splats);
    add_views(c, own, row);
}

static int run(race *c, cJSON *rows)
{
    const bench_options *o = c->options;
    double *values = calloc((size_t)(o->views * o->repeat), sizeof *values);
    c->loads = calloc((size_t)o->views, sizeof *c->loads);
    c->views = calloc((size_t)o->views, sizeof *c->views);
    bool taken = values && c->loads && c->views;
    int status = taken ? 0 : trip_fail(TRIP_ERROR, "bench", "runs", "out of memory");
    for (int size = 0; size < o->size_count && !status; size++) {
        status = draw_views(c, o->sizes[size]);
        for (int i = 0; i < c->count && !status; i++)
            add_row(c, &c->contenders[i], o->sizes[size], values, rows);
    }
    free(values);
    return status;
}

static bool leaves_out_occluded(const race *c)
{
    for (int i = 0; i < c->count; i++)
        if (!c->options->draw_occluded && !strcmp(c->contenders[i].renderer->ops->name, "cpu"))
            return true;
    return false;
}

static void add_limits(const race *c, bench_report *r)
{
    bench_report_limit(
        r, "A frame begins with the data set in memory, so that no time includes the disk. It ends "
           "with the picture in the memory of the program.");
    if (counts(c)) {
        bench_report_limit(
            r, "million splats/s: splats with a pixel centre in their footprint where their "
               "list has weight, summed over all views / time of all views. Splats "
               "behind opaque ones count too, although a renderer may skip them.");
        bench_report_limit(
            r, "million pixels/s: pixel centres in these footprints, from every %dth splat.",
            SAMPLE_EVERY);
    }
    if (leaves_out_occluded(c))
        bench_report_limit(r, "cpu skips bricks behind opaque ones; the picture is the same.");
    bench_report_limit(r, "Times are over all views. In each view the renderers take turns, and "
                          "the first frame of each turn is untimed.");
    if (c->options->usual)
        bench_report_limit(
            r, "default: the command `triptych render` without options, in views around "
               "the object by --azimuth. The other rows draw with options, which "
               "Settings lists.");
}

int bench_renderers(const session *s, const bench_options *o, bench_report *r)
{
    race *c = calloc(1, sizeof *c);
    if (!c)
        return trip_fail(TRIP_ERROR, "bench", "renderers", "out of memory");
    c->session = s;
    c->options = o;
    cJSON_AddNumberToObject(r->settings, "views", o->views);
    int status = add_contenders(c, r);
    add_limits(c, r);
    int frames = c->count * (1 + o->repeat) + (counts(c) ? 2 : 0); /* per view */
    measure_progress_expect(o->progress, 1 + frames * o->views * o->size_count);
    cJSON *rows = bench_report_add_table(
        r, "renderers", "Frames of the renderers, in views around the object",
        counts(c) ? counted_columns : columns,
        (int)(counts(c) ? sizeof counted_columns : sizeof columns) / (int)sizeof *columns);
    if (!status && o->usual)
        status = bench_default(o, r, rows);
    measure_progress_step(o->progress, "loading the data set");
    if (!status)
        status = bench_reader_create(s, &c->reader, o, TRIP_ENGINE_NULL, NULL, occluder_of(c));
    if (!status)
        status = run(c, rows);
    if (c->reader)
        trip_reader_destroy(c->reader);
    for (int i = 0; i < c->count; i++) {
        bench_renderer_destroy(c->contenders[i].renderer);
        free(c->contenders[i].costs);
    }
    free(c->loads);
    free(c->views);
    free(c);
    return status;
}
