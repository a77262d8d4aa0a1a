/* The default of `triptych render`: a frame of the library without any setting. Part of bench
 * renderers. */
#include "bench_tables.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "bench_context.h"
#include "clock.h"
#include "machine.h"
#include "median.h"
#include "report.h"

enum { SIDE = 1024 }; /* default --size of `render` */

typedef struct drawing {
    const bench_options *options;
    bench_context context;
    triptych_frame_stats stats; /* of the first frame */
    float *rgba;
    double *ms; /* [view * repeat + run] */
    cJSON *views;
} drawing;

static void add_vector(cJSON *object, const char *name, const double v[3])
{
    cJSON_AddItemToObject(object, name, cJSON_CreateDoubleArray(v, 3));
}

static int draw(drawing *d, double *ms)
{
    measure_progress_step(d->options->progress, "frame of the default");
    const double begin = trip_now_ms();
    const int status = triptych_draw(d->context.t, d->rgba);
    *ms = trip_now_ms() - begin;
    if (status)
        trip_report_line(triptych_error(d->context.t));
    return status;
}

/* The first frame of a view is untimed. It brings the data into memory. */
static int draw_view(drawing *d, int view)
{
    const bench_options *o = d->options;
    const triptych_view turned = { .azimuth_degrees = 360.0 * view / o->views };
    double untimed, *ms = d->ms + view * o->repeat;
    triptych_camera camera;
    int status = bench_context_find(&d->context, &turned, &camera);
    if (!status)
        status = draw(d, &untimed);
    if (!status && view == 0)
        status = triptych_get_frame_stats(d->context.t, &d->stats);
    for (int run = 0; run < o->repeat && !status; run++)
        status = draw(d, &ms[run]);
    if (status)
        return status;
    cJSON *one = measure_new_row(d->views);
    add_vector(one, "eye", camera.eye);
    add_vector(one, "look", camera.look);
    add_vector(one, "up", camera.up);
    cJSON_AddNumberToObject(one, "fov_degrees", camera.fov_degrees);
    cJSON_AddItemToObject(one, "ms", cJSON_CreateDoubleArray(ms, o->repeat));
    return 0;
}

static void add_row(drawing *d, bench_report *r, cJSON *rows)
{
    static const char *const interpolations[] = { "none", "linear", "cubic", "gaussian",
                                                  "nearest" };
    const triptych_frame_stats *s = &d->stats;
    const bench_options *o = d->options;
    const int size[2] = { SIDE, SIDE }, frames = o->views * o->repeat;
    const bool post = s->classify == TRIPTYCH_CLASSIFY_POST;
    const double median = measure_median(d->ms, frames);
    unsigned threads = 0;
    char text[256];
    cJSON *row = measure_new_row(rows);
    cJSON_AddStringToObject(row, "name", "default");
    cJSON_AddStringToObject(row, "renderer", s->renderer);
    cJSON_AddStringToObject(row, "device", s->device);
    if (!strcmp(s->renderer, "cpu"))
        threads = (unsigned)sysconf(_SC_NPROCESSORS_ONLN);
    if (threads)
        cJSON_AddNumberToObject(row, "threads", threads);
    bench_report_add_size(row, size);
    measure_add(row, { "views", o->views }, { "ms", median }, { "ms_min", d->ms[0] },
                { "ms_max", d->ms[frames - 1] }, { "fps", 1e3 / median });
    cJSON_AddStringToObject(row, "classify", post ? "post" : "pre");
    cJSON_AddStringToObject(row, "interpolation", interpolations[s->interpolation]);
    measure_add(row, { "samples_per_sheet", s->samples_per_sheet },
                { "early_termination", s->early_termination }, { "effects", s->effects });
    cJSON_AddItemToObject(row, "each_view", d->views);
    d->views = NULL;
    int at = snprintf(text, sizeof text, "--size %dx%d --renderer %s --classify %s", SIDE, SIDE,
                      s->renderer, post ? "post" : "pre");
    if (post)
        at += snprintf(text + at, sizeof text - (size_t)at,
                       " --interpolation %s --samples-per-sheet %d",
                       interpolations[s->interpolation], s->samples_per_sheet);
    snprintf(text + at, sizeof text - (size_t)at, " --early-termination %.4g --effects %s",
             s->early_termination, s->effects ? "auto" : "none");
    cJSON_AddStringToObject(r->settings, "default_in_its_first_view", text);
}

int bench_default(const bench_options *o, bench_report *r, cJSON *rows)
{
    bench_options usual = *o;
    drawing d = { .options = o, .views = cJSON_CreateArray() };
    usual.renderers[0] = TRIP_RENDERER_AUTO;
    usual.threads[0] = 0;
    measure_progress_expect(o->progress, o->views * (1 + o->repeat));
    int status = bench_context_open(&d.context, o->input, &usual);
    d.ms = calloc((size_t)(o->views * o->repeat), sizeof *d.ms);
    if (!status && !d.ms)
        status = trip_fail(TRIP_ERROR, "bench", "runs", "out of memory");
    if (!status)
        status = bench_context_picture(&d.context, SIDE, SIDE, &d.rgba);
    for (int view = 0; view < o->views && !status; view++)
        status = draw_view(&d, view);
    if (!status)
        add_row(&d, r, rows);
    triptych_release_picture(d.context.t, d.rgba);
    bench_context_close(&d.context);
    cJSON_Delete(d.views);
    free(d.ms);
    return status;
}
