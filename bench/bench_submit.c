/* bench submit: compares the forms of submission to OpenGL with Tables 3 and 4 of Hofsetz, Max &
 * Bastos 2008. */
#include "bench_tables.h"

#include <stdlib.h>
#include <string.h>

#include "bench_view.h"
#include "clock.h"
#include "error.h"
#include "report.h"

enum { FORMS = 14, PAPER_SETS = 4 };

/* Results of Hofsetz, Max & Bastos 2008. Table 3 has frames per second, Table 4 the seconds before
 * the first frame. 0 means that the form did not fit. "align" in the paper is one list, and "pbuff"
 * is three merged lists. The replicated lists of the paper stay on the GPU, as resident lists do
 * here. */
static const struct form {
    enum { RESIDENT, INDEXED, REPLICATED } lists;
    bool merged;
    enum { FIXED, SPRITES, TRIANGLES } primitives;
    double paper_fps[PAPER_SETS], paper_start_s[PAPER_SETS];
} forms[FORMS] = {
    { RESIDENT, false, FIXED, { 61.16, 32.79, 22.45, 6.07 }, { 3.91, 2.82, 4.67, 6.33 } },
    { RESIDENT, true, FIXED, { 61.16, 23.27, 18.02, 3.03 }, { 3.26, 3.35, 5.64, 55.51 } },
    { RESIDENT, false, TRIANGLES, { 58.31, 29.81, 20.00, 0 }, { 4.32, 3.64, 5.86, 0 } },
    { RESIDENT, true, TRIANGLES, { 31.25, 14.40, 5.40, 0 }, { 3.57, 4.15, 73.55, 0 } },
    { INDEXED, false, FIXED, { 58.48, 30.53, 20.39, 2.94 }, { 4.22, 3.38, 5.69, 5.92 } },
    { INDEXED, true, FIXED, { 47.51, 15.29, 15.09, 1.53 }, { 3.27, 3.19, 5.47, 5.50 } },
    { INDEXED, false, TRIANGLES, { 61.16, 5.49, 4.32, 0 }, { 3.10, 3.16, 5.19, 0 } },
    { INDEXED, true, TRIANGLES, { 29.85, 2.49, 2.00, 0 }, { 3.46, 3.52, 5.89, 0 } },
    { REPLICATED, false, FIXED, { 0 }, { 0 } },
    { REPLICATED, true, FIXED, { 0 }, { 0 } },
    { REPLICATED, false, SPRITES, { 0 }, { 0 } },
    { REPLICATED, true, SPRITES, { 0 }, { 0 } },
    { REPLICATED, false, TRIANGLES, { 0 }, { 0 } },
    { REPLICATED, true, TRIANGLES, { 0 }, { 0 } },
};

static const char *const primitives[] = { "fixed sprites", "sprites", "triangles" };

static const char *lists_of(const struct form *f)
{
    static const char *const names[] = { "resident", "indexed", "replicated" };
    return names[f->lists];
}

static const char *orders_of(const struct form *f)
{
    return f->merged ? "merge" : "axis";
}

static const char *const paper_keys[PAPER_SETS] = { "paper_engine", "paper_foot", "paper_head",
                                                    "paper_mri" };

static const measure_column columns[] = {
    { "lists", "lists", 0, 0 },     { "primitives", "primitives", 0, 0 },
    { "orders", "orders", 0, 0 },   { "projected", "projected x kept", 3, 0 },
    { "multiple", "x kept", 3, 0 }, { "lost_mean", "change: mean of 255", 5, 0 },
    { "lost_max", "max", 3, 0 },    { "ms", "median ms", 1, 0 },
    { "speed", "speed", 3, 0 },     { "paper_engine", "2008: Engine", 3, 0 },
    { "paper_foot", "Foot", 3, 0 }, { "paper_head", "Head", 3, 0 },
    { "paper_mri", "MRI", 3, 0 },
};

static const measure_column start_columns[] = {
    { "lists", "lists", 0, 0 },
    { "primitives", "primitives", 0, 0 },
    { "orders", "orders", 0, 0 },
    { "start_s", "start, s", 3, 0 },
    { "paper_engine", "2008: Engine, s", 2, 0 },
    { "paper_foot", "Foot, s", 2, 0 },
    { "paper_head", "Head, s", 2, 0 },
    { "paper_mri", "MRI, s", 2, 0 },
};

/* The measurements of the forms. A form without a renderer is left out. */
typedef struct submission {
    bench_frame frames[FORMS];
    bench_cost counted[FORMS];
    double start_s[FORMS];
    measure_error_figures lost[FORMS]; /* by culling with two points */
    bench_runs runs;
    float *exact; /* a picture without this culling, or NULL */
    measure_error *error;
    size_t pixels;
} submission;

static void add_names(cJSON *row, const struct form *f)
{
    cJSON_AddStringToObject(row, "lists", lists_of(f));
    cJSON_AddStringToObject(row, "primitives", primitives[f->primitives]);
    cJSON_AddStringToObject(row, "orders", orders_of(f));
}

static void add_row(cJSON *rows, submission *s, int base, int form)
{
    const bench_frame *frame = &s->frames[form];
    const double kept = (double)frame->session->data->header.kept;
    cJSON *row = measure_new_row(rows);
    add_names(row, &forms[form]);
    if (frame->renderer) {
        const trip_list_stats *all = &s->counted[form].stats.all;
        bench_runs_describe(&s->runs, form, base, &s->counted[form], kept, row);
        cJSON_AddNumberToObject(row, "projected",
                                kept > 0 ? (double)all->splats_projected / kept : 0);
        if (s->exact)
            measure_add(row, { "lost_mean", s->lost[form].mean },
                        { "lost_max", s->lost[form].max });
    }
    for (int i = 0; i < PAPER_SETS; i++)
        if (forms[form].paper_fps[i] > 0)
            cJSON_AddNumberToObject(row, paper_keys[i],
                                    forms[form].paper_fps[i] / forms[0].paper_fps[i]);
}

static void add_start(cJSON *rows, const submission *s, int form)
{
    cJSON *row = measure_new_row(rows);
    add_names(row, &forms[form]);
    if (s->frames[form].renderer)
        cJSON_AddNumberToObject(row, "start_s", s->start_s[form]);
    for (int i = 0; i < PAPER_SETS; i++)
        if (forms[form].paper_start_s[i] > 0)
            cJSON_AddNumberToObject(row, paper_keys[i], forms[form].paper_start_s[i]);
}

static bench_frame frame_of(const bench_frame *base, const bench_options *o, const struct form *f)
{
    bench_frame frame = *base;
    frame.view = bench_view_oblique(base->session, o->sizes[0]);
    frame.settings.method = f->merged ? TRIP_METHOD_MERGE : TRIP_METHOD_AXIS;
    frame.settings.indexed = f->lists == INDEXED;
    frame.settings.resident = f->lists == RESIDENT;
    frame.settings.triangles = f->primitives == TRIANGLES;
    if (f->primitives == FIXED)
        frame.settings.footprint = TRIP_FOOTPRINT_FIXED;
    return frame;
}

/* Times a new renderer and reader up to the end of their first frame. */
static int time_start(const bench_frame *frame, const bench_options *o, double *seconds)
{
    char why[256];
    bench_cost cost;
    bench_frame own = *frame;
    const double start = trip_now_ms();
    own.renderer = NULL;
    own.reader = NULL;
    int status = bench_renderer_create(own.session, &own.renderer, TRIP_RENDERER_GL, o->threads[0],
                                       true, why);
    if (!status)
        status =
            bench_reader_create(own.session, &own.reader, o, TRIP_ENGINE_NULL, own.renderer, NULL);
    if (!status)
        status = bench_frame_draw(&own, false, &cost);
    else
        measure_progress_expect(o->progress, -1);
    *seconds = (trip_now_ms() - start) / 1e3;
    if (own.reader)
        trip_reader_destroy(own.reader);
    bench_renderer_destroy(own.renderer);
    return status;
}

/* Draws a form without and with culling by two points, and compares the pictures. */
static int measure_lost(submission *s, int form)
{
    bench_frame whole = s->frames[form];
    bench_cost cost;
    whole.settings.two_point_culling = false;
    int status = bench_frame_draw(&whole, false, &cost);
    memcpy(s->exact, whole.rgba, 4 * s->pixels * sizeof *s->exact);
    if (!status)
        status = bench_frame_draw(&s->frames[form], true, &s->counted[form]);
    else
        measure_progress_expect(whole.progress, -1);
    *s->error = (measure_error){ 0 };
    measure_error_add(s->error, s->frames[form].rgba, s->exact, s->pixels);
    s->lost[form] = measure_error_measure(s->error);
    return status;
}

/* Draws the first frames of a form: the timed start, then a counted frame. Leaves out a form that
 * does not fit. */
static int warm_up(submission *s, const bench_options *o, bench_report *r, int form)
{
    char why[256] = "";
    bench_frame *f = &s->frames[form];
    bench_keep_report(why);
    int status = time_start(f, o, &s->start_s[form]);
    if (status)
        measure_progress_expect(o->progress, s->exact ? -2 : -1);
    else
        status = s->exact ? measure_lost(s, form) : bench_frame_draw(f, true, &s->counted[form]);
    bench_keep_report(NULL);
    if (!status || trip_interrupted())
        return status;
    bench_report_limit(r, "left out: %s %s, %s: %s", lists_of(&forms[form]),
                       primitives[forms[form].primitives], orders_of(&forms[form]), why);
    f->renderer = NULL;
    measure_progress_expect(o->progress, -o->repeat);
    return 0;
}

static int report(submission *s, bench_report *r)
{
    int base = 0;
    while (base < FORMS && !s->frames[base].renderer)
        base++;
    if (base == FORMS)
        return trip_fail(TRIP_ERROR, "bench", "submit",
                         "no form fits the memory; raise --memory or reduce --size");
    cJSON *rows = bench_report_table(
        r, "submit",
        "Oblique view, all three lists (2008, Table 3); speed is relative to the first row",
        columns);
    for (int i = 0; i < FORMS; i++)
        add_row(rows, s, base, i);
    rows = bench_report_table(r, "start", "Time before the first picture (2008, Table 4)",
                              start_columns);
    for (int i = 0; i < FORMS; i++)
        add_start(rows, s, i);
    return 0;
}

static int measure(submission *s, const bench_frame *base, const bench_options *o, bench_report *r)
{
    int status = 0;
    for (int i = 0; i < FORMS && !status; i++) {
        s->frames[i] = frame_of(base, o, &forms[i]);
        status = warm_up(s, o, r, i);
    }
    if (!status)
        status = bench_runs_take(&s->runs, s->frames, FORMS, o->repeat);
    if (!status)
        status = report(s, r);
    bench_runs_free(&s->runs);
    return status;
}

static void add_limits(bench_report *r)
{
    bench_report_limit(
        r, "resident and indexed lists stay in GPU memory; replicated lists go from memory to the "
           "GPU in every frame. The papers compare resident and indexed lists; they call resident "
           "lists replicated.");
    bench_report_limit(r, "All sprites of the papers have the same size, like fixed sprites. "
                          "Sprites with the size of each splat are an addition here.");
    bench_report_limit(r,
                       "x kept: splats drawn / voxels kept per list. speed: time of the first row "
                       "/ time.");
    bench_report_limit(r, "With software OpenGL, rasterising on the processor limits all forms.");
    bench_report_limit(r, "projected: splats that culling by weight and by the eye leaves. "
                          "--culling two-points culls by w +- dw as in 2008, section 5.4, which "
                          "may lose splats; change is the difference from the default's picture.");
    bench_report_limit(r,
                       "merge has h = 0.85. Times are medians of runs that are taken alternately.");
    bench_report_limit(r,
                       "start: from a new OpenGL context to the end of its first frame: shaders, "
                       "lists to memory and to the GPU. The paper includes the start of the "
                       "program, its window and the gradients. It calls swapping the likely "
                       "reason for the two long times.");
    bench_report_limit(r, "2008: Hofsetz, Max & Bastos at 512 x 512 on a GeForce 7900 GT; the "
                          "Engine seems limited by a display with 60 Hz. - means that the form did "
                          "not fit. Objects, views and kernels differ.");
}

int bench_submit(bench_scene *scene, const bench_options *o, bench_report *r)
{
    trip_budget *budget = scene->frame.session->budget;
    const bool two_points = o->settings.two_point_culling;
    submission s = { .pixels = (size_t)scene->size[0] * (size_t)scene->size[1] };
    const size_t bytes = 4 * s.pixels * sizeof(float);
    measure_progress_expect(o->progress, FORMS * ((two_points ? 3 : 2) + o->repeat));
    add_limits(r);
    if (two_points) {
        s.exact = trip_budget_take(budget, bytes);
        s.error = malloc(sizeof *s.error);
    }
    int status = two_points && !(s.exact && s.error)
                     ? trip_fail(TRIP_ERROR, "bench", "submit",
                                 "another picture does not fit the memory; raise --memory or "
                                 "reduce --size")
                     : measure(&s, &scene->frame, o, r);
    trip_budget_release(budget, s.exact, bytes);
    free(s.error);
    return status;
}
