/* bench submit: compares the forms of submission to OpenGL with Table 3 of Hofsetz, Max & Bastos
 * 2008. */
#include "bench_tables.h"

#include <string.h>

#include "bench_view.h"
#include "report.h"

enum { FORMS = 10, PAPER_SETS = 4 };

/* Frames per second in Hofsetz, Max & Bastos 2008, Table 3; 0 means that the form did not fit.
 * "align" in the paper is one list, and "pbuff" is three merged lists. */
static const struct form {
    bool indexed, merged;
    enum { FIXED, SPRITES, TRIANGLES } primitives;
    double paper_fps[PAPER_SETS];
} forms[FORMS] = {
    { false, false, FIXED, { 61.16, 32.79, 22.45, 6.07 } },
    { false, true, FIXED, { 61.16, 23.27, 18.02, 3.03 } },
    { false, false, SPRITES, { 0 } },
    { false, true, SPRITES, { 0 } },
    { false, false, TRIANGLES, { 58.31, 29.81, 20.00, 0 } },
    { false, true, TRIANGLES, { 31.25, 14.40, 5.40, 0 } },
    { true, false, FIXED, { 58.48, 30.53, 20.39, 2.94 } },
    { true, true, FIXED, { 47.51, 15.29, 15.09, 1.53 } },
    { true, false, TRIANGLES, { 61.16, 5.49, 4.32, 0 } },
    { true, true, TRIANGLES, { 29.85, 2.49, 2.00, 0 } },
};

static const char *const primitives[] = { "fixed sprites", "sprites", "triangles" };

static const char *lists_of(const struct form *f)
{
    return f->indexed ? "indexed" : "replicated";
}

static const char *orders_of(const struct form *f)
{
    return f->merged ? "merge" : "axis";
}

static const char *const paper_keys[PAPER_SETS] = { "paper_engine", "paper_foot", "paper_head",
                                                    "paper_mri" };

static const measure_column columns[] = {
    { "lists", "lists", 0, 0 },
    { "primitives", "primitives", 0, 0 },
    { "orders", "orders", 0, 0 },
    { "multiple", "x kept", 3, 0 },
    { "ms", "median ms", 1, 0 },
    { "speed", "speed", 3, 0 },
    { "paper_engine", "2008: Engine", 3, 0 },
    { "paper_foot", "Foot", 3, 0 },
    { "paper_head", "Head", 3, 0 },
    { "paper_mri", "MRI", 3, 0 },
};

static void add_row(cJSON *rows, bench_runs *runs, const bench_frame *frame,
                    const bench_cost *counted, int form)
{
    cJSON *row = measure_new_row(rows);
    cJSON_AddStringToObject(row, "lists", lists_of(&forms[form]));
    cJSON_AddStringToObject(row, "primitives", primitives[forms[form].primitives]);
    cJSON_AddStringToObject(row, "orders", orders_of(&forms[form]));
    if (frame->renderer)
        bench_runs_describe(runs, form, 0, counted, (double)frame->session->data->header.kept, row);
    for (int i = 0; i < PAPER_SETS; i++)
        if (forms[form].paper_fps[i] > 0)
            cJSON_AddNumberToObject(row, paper_keys[i],
                                    forms[form].paper_fps[i] / forms[0].paper_fps[i]);
}

/* Draws one counted frame, which also loads data and compiles shaders. Leaves out a form that does
 * not fit. */
static int warm_up(bench_frame *f, bench_cost *counted, bench_report *r, int form)
{
    char why[256] = "";
    bench_keep_report(form ? why : NULL);
    int status = bench_frame_draw(f, true, counted);
    bench_keep_report(NULL);
    if (!status || form == 0 || trip_interrupted())
        return status;
    bench_report_limit(r, "left out: %s %s, %s: %s", lists_of(&forms[form]),
                       primitives[forms[form].primitives], orders_of(&forms[form]), why);
    f->renderer = NULL;
    return 0;
}

static int measure(const bench_frame *base, const bench_options *o, bench_report *r)
{
    bench_frame frames[FORMS];
    bench_cost counted[FORMS];
    bench_runs runs = { 0 };
    int status = 0;
    for (int i = 0; i < FORMS && !status; i++) {
        frames[i] = *base;
        frames[i].view = bench_view_oblique(base->session, o->sizes[0]);
        frames[i].settings.method = forms[i].merged ? TRIP_METHOD_MERGE : TRIP_METHOD_AXIS;
        frames[i].settings.indexed = forms[i].indexed;
        frames[i].settings.triangles = forms[i].primitives == TRIANGLES;
        if (forms[i].primitives == FIXED)
            frames[i].settings.footprint = TRIP_FOOTPRINT_FIXED;
        status = warm_up(&frames[i], &counted[i], r, i);
        if (!frames[i].renderer)
            measure_progress_expect(o->progress, -o->repeat);
    }
    if (!status)
        status = bench_runs_take(&runs, frames, FORMS, o->repeat);
    if (!status) {
        cJSON *rows = bench_report_table(
            r, "submit",
            "Oblique view, all three lists (2008, Table 3); speed is relative to the first row",
            columns);
        for (int i = 0; i < FORMS; i++)
            add_row(rows, &runs, &frames[i], &counted[i], i);
    }
    bench_runs_free(&runs);
    return status;
}

static void add_limits(bench_report *r)
{
    bench_report_limit(
        r,
        "replicated lists go from memory to the GPU in every frame; indexed lists stay in GPU "
        "memory. The papers compare two ways to fill vertex buffers, which both stay on the GPU.");
    bench_report_limit(r, "All sprites of the papers have the same size, like fixed sprites. "
                          "Sprites with the size of each splat are an addition here.");
    bench_report_limit(r,
                       "x kept: splats drawn / voxels kept per list. speed: time of the first row "
                       "/ time.");
    bench_report_limit(r, "With software OpenGL, rasterising on the processor limits all forms.");
    bench_report_limit(r,
                       "merge has h = 0.85. Times are medians of runs that are taken alternately.");
    bench_report_limit(r, "2008: Hofsetz, Max & Bastos at 512 x 512 on a GeForce 7900 GT; the "
                          "Engine seems limited by a display with 60 Hz. - means that the form did "
                          "not fit. Objects, views and kernels differ.");
}

int bench_submit(bench_scene *scene, const bench_options *o, bench_report *r)
{
    measure_progress_expect(o->progress, FORMS * (1 + o->repeat));
    add_limits(r);
    return measure(&scene->frame, o, r);
}
