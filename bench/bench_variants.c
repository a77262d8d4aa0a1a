/* bench variants: measures the change of the picture by the shortcuts of the papers, and by
 * image-aligned sheets, with the reference renderer. */
#include "bench_tables.h"

#include <stdlib.h>
#include <string.h>

#include "bench_view.h"
#include "error.h"
#include "normalise.h"
#include "report.h"

static const struct form {
    const char *name;
    trip_method method;
    double h;
    trip_footprint footprint;
    bool vertex_weights, normalise;
} variants[] = {
    { "merge, h = 0.85", TRIP_METHOD_MERGE, 0.85, TRIP_FOOTPRINT_EXACT, false, false },
    { "fixed sprites", TRIP_METHOD_MERGE, 0.85, TRIP_FOOTPRINT_FIXED, false, false },
    { "vertex weights", TRIP_METHOD_MERGE, 0.85, TRIP_FOOTPRINT_EXACT, true, false },
    { "clip", TRIP_METHOD_CLIP, 0, TRIP_FOOTPRINT_EXACT, false, false },
    { "axis", TRIP_METHOD_AXIS, 0, TRIP_FOOTPRINT_EXACT, false, false },
    { "image-aligned sheets", TRIP_METHOD_IMAGE, 0, TRIP_FOOTPRINT_EXACT, false, false },
    { "colour over opacity", TRIP_METHOD_MERGE, 0.85, TRIP_FOOTPRINT_EXACT, false, true },
};

enum { VARIANTS = sizeof variants / sizeof variants[0] };

static const measure_column columns[] = {
    { "form", "form", 0, 0 }, { "mean", "mean", 3, 0 }, { "percentile_99", "99 %", 2, 0 },
    { "max", "max", 1, 0 },   { "ms", "ms", 0, 0 },
};

/* `defaults` keeps the picture of the first form. */
static int measure(bench_frame *frame, const bench_options *o, float *defaults,
                   measure_error *error, bench_report *r)
{
    static const double none[4] = { 0 };
    const size_t pixels = (size_t)o->sizes[0][0] * (size_t)o->sizes[0][1];
    cJSON *rows = bench_report_table(
        r, "variants", "Oblique view: change of the picture against the first row, of 255",
        columns);
    int status = 0;
    frame->view = bench_view_oblique(frame->session, o->sizes[0]);
    memset(frame->settings.background, 0, sizeof frame->settings.background);
    for (int i = 0; i < VARIANTS && !status; i++) {
        bench_cost cost;
        frame->settings.method = variants[i].method;
        frame->settings.h = variants[i].h;
        frame->settings.footprint = variants[i].footprint;
        frame->settings.vertex_weights = variants[i].vertex_weights;
        status = bench_frame_draw(frame, false, &cost);
        if (status)
            break;
        if (variants[i].normalise)
            trip_normalise(frame->rgba, pixels, none);
        if (i == 0)
            memcpy(defaults, frame->rgba, 4 * pixels * sizeof *defaults);
        cJSON *row = measure_new_row(rows);
        cJSON_AddStringToObject(row, "form", variants[i].name);
        *error = (measure_error){ 0 };
        measure_error_add(error, frame->rgba, defaults, pixels);
        const measure_error_figures figures = measure_error_measure(error);
        measure_add(row, { "mean", figures.mean }, { "percentile_99", figures.percentile_99 },
                    { "max", figures.max }, { "ms", cost.ms });
    }
    return status;
}

static void add_limits(bench_report *r)
{
    bench_report_limit(r, "The reference draws in double precision, and times are of a single "
                          "frame. Errors are over the components of the pixels that either picture "
                          "covers, premultiplied, without background.");
    bench_report_limit(
        r, "fixed sprites: Hofsetz, Max & Bastos 2008, section 5.2, where the difference is called "
           "negligible. vertex weights: section 4.2. colour over opacity: Hofsetz & Max 2005, "
           "section 5, step 3. image-aligned sheets: Mueller & Crawfis 1998.");
}

int bench_variants(bench_scene *scene, const bench_options *o, bench_report *r)
{
    trip_budget *budget = scene->frame.session->budget;
    const size_t bytes = 4 * (size_t)scene->size[0] * (size_t)scene->size[1] * sizeof(float);
    float *defaults = trip_budget_take(budget, bytes);
    measure_error *error = malloc(sizeof *error);
    measure_progress_expect(o->progress, VARIANTS);
    add_limits(r);
    int status = defaults && error
                     ? measure(&scene->frame, o, defaults, error, r)
                     : trip_fail(TRIP_ERROR, "bench", "variants",
                                 "another picture does not fit the memory; raise --memory or "
                                 "reduce --size");
    trip_budget_release(budget, defaults, bytes);
    free(error);
    return status;
}
