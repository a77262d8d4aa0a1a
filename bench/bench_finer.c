/* Times and errors of one object that is sampled more and more finely. Part of bench levels. */
#include "bench_tables.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench_context.h"
#include "bench_sample.h"
#include "error.h"
#include "plot.h"
#include "report.h"
#include "median.h"

/* Voxels along each axis of the first volume; maximum number of volumes. */
enum { COARSEST = 128, MAX = 4, TRUTH_SAMPLES = 4, ENTRIES = 2 };

/* One volume, drawn by two contexts, so that each keeps the data that it reads. */
typedef struct volume {
    bench_sample sample;
    bench_context contexts[ENTRIES]; /* [0] for the finest level, [1] for coarse levels */
    double *ms[ENTRIES];             /* sums of each run over all views */
    measure_error colour[ENTRIES], alpha[ENTRIES];
} volume;

typedef struct measuring {
    const bench_options *options;
    volume *volumes; /* each has twice the resolution of the one before */
    int count;
    double lod_px;
    size_t pixels;
    float *rgba, *truth;
} measuring;

static int open_volume(measuring *m, int i)
{
    const bench_options *o = m->options;
    volume *v = &m->volumes[i];
    measure_progress_step(o->progress, "volume");
    int status = bench_sample_make_field(&v->sample, o->field, COARSEST << i, o->tf);
    for (int e = 0; e < ENTRIES && !status; e++) {
        v->ms[e] = calloc((size_t)o->repeat, sizeof *v->ms[e]);
        if (!v->ms[e])
            return trip_fail(TRIP_ERROR, "bench", "levels", "out of memory");
        status = bench_context_open(&v->contexts[e], v->sample.data, o);
    }
    return status;
}

/* Computes a view around the first volume; all volumes share the views. */
static int find_view(measuring *m, int view, triptych_camera *camera)
{
    const bench_options *o = m->options;
    const triptych_view wanted = { .width = o->sizes[0][0],
                                   .height = o->sizes[0][1],
                                   .azimuth_degrees = 360.0 * view / o->views,
                                   .turntable = 1 };
    return bench_context_find(&m->volumes[0].contexts[0], &wanted, camera);
}

/* Computes the maximum width in pixels of the first volume's voxels. With this --lod all volumes
 * are drawn about as coarsely as the first one. */
static int find_lod(measuring *m)
{
    triptych_camera camera;
    double voxel, distance = 0;
    int status = find_view(m, 0, &camera);
    if (!status)
        status = bench_context_voxel(&m->volumes[0].contexts[0], &voxel);
    if (status)
        return status;
    for (int a = 0; a < 3; a++)
        distance = hypot(distance, camera.eye[a] - camera.look[a]);
    const double near = distance - 0.5 * sqrt(3) * voxel * COARSEST;
    const double slope = 2 * tan(camera.fov_degrees * 3.14159265358979323846 / 360);
    m->lod_px = voxel / (near * slope / camera.height);
    return 0;
}

static int draw(measuring *m, volume *v, int e, const triptych_camera *camera, int samples,
                float *rgba, double *ms)
{
    int status = bench_context_look(&v->contexts[e], camera);
    return status ? status
                  : bench_context_draw(&v->contexts[e], e ? m->lod_px : 0, samples, rgba, ms);
}

/* Draws the reference from the finest volume, then draws all volumes once, untimed. */
static int measure_errors(measuring *m, const triptych_camera *camera)
{
    int status = draw(m, &m->volumes[m->count - 1], 0, camera, TRUTH_SAMPLES, m->truth, NULL);
    for (int i = 0; i < m->count; i++)
        for (int e = 0; e < ENTRIES && !status; e++) {
            volume *v = &m->volumes[i];
            status = draw(m, v, e, camera, 1, m->rgba, NULL);
            if (!status)
                measure_error_add_apart(&v->colour[e], &v->alpha[e], m->rgba, m->truth, m->pixels);
        }
    return status;
}

/* Times all volumes alternately, run by run. */
static int measure_times(measuring *m, const triptych_camera *camera)
{
    int status = 0;
    for (int run = 0; run < m->options->repeat; run++)
        for (int i = 0; i < m->count; i++)
            for (int e = 0; e < ENTRIES && !status; e++) {
                double ms = 0;
                status = draw(m, &m->volumes[i], e, camera, 1, m->rgba, &ms);
                m->volumes[i].ms[e][run] += ms / m->options->views;
            }
    return status;
}

static int measure(measuring *m)
{
    int status = find_lod(m);
    for (int view = 0; view < m->options->views && !status; view++) {
        triptych_camera camera;
        status = find_view(m, view, &camera);
        if (!status)
            status = measure_errors(m, &camera);
        if (!status)
            status = measure_times(m, &camera);
    }
    return status;
}

static const measure_column columns[] = {
    { "voxels", "voxels per side", 0, 0 },
    { "fine_ms", "finest: ms", 1, 0 },
    { "fine_growth", "x previous", 2, 0 },
    { "fine_colour", "colour", 2, 0 },
    { "fine_alpha", "alpha", 2, 0 },
    { "ms", "levels: ms", 1, 0 },
    { "growth", "x previous", 2, 0 },
    { "colour", "colour", 2, 0 },
    { "alpha", "alpha", 2, 0 },
};

/* Adds a row for each volume: milliseconds per frame, and mean errors of 255. */
static void add_rows(const measuring *m, cJSON *rows)
{
    for (int i = 0; i < m->count; i++) {
        volume *v = &m->volumes[i];
        const double fine_ms = measure_median(v->ms[0], m->options->repeat);
        const double ms = measure_median(v->ms[1], m->options->repeat);
        const cJSON *last = i > 0 ? cJSON_GetArrayItem(rows, i - 1) : NULL;
        cJSON *row = measure_new_row(rows);
        measure_add(row, { "voxels", COARSEST << i }, { "fine_ms", fine_ms }, { "ms", ms },
                    { "fine_colour", measure_error_measure(&v->colour[0]).mean },
                    { "fine_alpha", measure_error_measure(&v->alpha[0]).mean },
                    { "colour", measure_error_measure(&v->colour[1]).mean },
                    { "alpha", measure_error_measure(&v->alpha[1]).mean });
        if (last)
            measure_add(row, { "fine_growth", fine_ms / measure_number(last, "fine_ms") },
                        { "growth", ms / measure_number(last, "ms") });
    }
}

/* Plots the times over the resolution. */
static int save_plot(const cJSON *rows, const char *path)
{
    static const char *const names[MAX] = { "128\302\263", "256\302\263", "512\302\263",
                                            "1024\302\263" };
    static const measure_curve curves[] = { { "fine_ms", "finest level", "#b03020" },
                                            { "ms", "coarse levels", "#2050b0" } };
    const measure_plot plot = { .width = 560,
                                .height = 360,
                                .x_title = "voxels",
                                .y_title = "ms per frame",
                                .names = names,
                                .name_count = cJSON_GetArraySize(rows) };
    return measure_plot_save(measure_plot_rows(&plot, rows, curves, ENTRIES, MAX), path);
}

static void describe(const bench_options *o, bench_report *r)
{
    cJSON *settings = r->settings;
    char render[256];
    bench_report_add_size(settings, o->sizes[0]);
    cJSON_AddStringToObject(settings, "field", o->field);
    bench_options_write(o, render, sizeof render);
    cJSON_AddStringToObject(settings, "options_of_render", render);
    cJSON_AddNumberToObject(settings, "repeat", o->repeat);
}

static int report(const measuring *m, bench_report *r)
{
    cJSON *rows = bench_report_table(r, "finer",
                                     "Frames of one object, sampled more and more finely", columns);
    add_rows(m, rows);
    describe(m->options, r);
    bench_report_limit(
        r,
        "Coarse levels are selected by --lod %.3g. This is the maximum width in pixels of a voxel "
        "of the first volume, so that all volumes are drawn about as coarsely as the first.",
        m->lod_px);
    bench_report_limit(r,
                       "Errors are means of 255 over the pixels that the object covers, with "
                       "premultiplied colour. The reference is the last volume at its finest "
                       "level, with %d x %d rays per pixel. Times are means over %d views around "
                       "the object, read from memory, and medians of %d runs, taken alternately.",
                       TRUTH_SAMPLES, TRUTH_SAMPLES, m->options->views, m->options->repeat);
    if (m->options->settings.shading)
        bench_report_limit(
            r, "The gradient for full shading depends on the voxel size, so that finer volumes are "
               "shaded differently. --no-shading removes this part of the errors of colour.");
    return m->options->plot ? save_plot(rows, m->options->plot) : 0;
}

static int begin(measuring *m)
{
    const bench_options *o = m->options;
    const size_t bytes = 4 * m->pixels * sizeof *m->rgba;
    m->volumes = calloc((size_t)m->count, sizeof *m->volumes);
    m->rgba = malloc(bytes);
    m->truth = malloc(bytes);
    if (!m->volumes || !m->rgba || !m->truth)
        return trip_fail(TRIP_ERROR, "bench", "levels", "out of memory");
    measure_progress_expect(o->progress,
                            m->count + o->views * (1 + m->count * ENTRIES * (1 + o->repeat)));
    int status = 0;
    for (int i = 0; i < m->count && !status; i++)
        status = open_volume(m, i);
    return status;
}

static void end(measuring *m)
{
    for (int i = 0; m->volumes && i < m->count; i++) {
        volume *v = &m->volumes[i];
        for (int e = 0; e < ENTRIES; e++) {
            bench_context_close(&v->contexts[e]);
            free(v->ms[e]);
        }
        bench_sample_remove(&v->sample);
    }
    free(m->volumes);
    free(m->rgba);
    free(m->truth);
}

int bench_finer(const bench_options *o, bench_report *r)
{
    measuring m = { .options = o,
                    .count = 1,
                    .pixels = (size_t)o->sizes[0][0] * (size_t)o->sizes[0][1] };
    while (m.count < MAX && COARSEST << m.count <= o->finest)
        m.count++;
    int status = begin(&m);
    if (!status)
        status = measure(&m);
    if (!status)
        status = report(&m, r);
    end(&m);
    return status;
}
