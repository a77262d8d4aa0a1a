/* bench popping: measures the jump of pixels while the camera turns through the change of the
 * dominant axis. */
#include "bench_tables.h"

#include "bench_view.h"
#include "plot.h"
#include "popping.h"
#include "report.h"

static const measure_column columns[] = {
    { "settings", "settings", 0, 0 },  { "mean", "mean", 3, 0 },
    { "percentile_99", "99 %", 3, 0 }, { "max", "max", 2, 0 },
    { "motion", "motion", 3, 0 },
};

static int draw_step(void *user, const measure_popping_setting *of, double degrees)
{
    const bench_scene *scene = user;
    bench_frame frame = scene->frame;
    bench_cost cost;
    frame.settings.background[3] = 0;
    frame.settings.method = (trip_method)(of->method - TRIPTYCH_METHOD_MERGE);
    frame.settings.h = of->h;
    frame.view = bench_view_between(frame.session, scene->size, degrees);
    return bench_frame_draw(&frame, false, &cost);
}

static int measure(bench_scene *scene, const bench_options *o, bench_report *r)
{
    trip_budget *budget = scene->frame.session->budget;
    const size_t pixels = (size_t)scene->size[0] * (size_t)scene->size[1];
    const size_t bytes = measure_popping_bytes(pixels);
    const bool image = scene->frame.renderer->ops->forms & TRIP_DRAWS_IMAGE_SHEETS &&
                       o->settings.classify == TRIP_CLASSIFY_PRE &&
                       o->settings.compositing == TRIP_COMPOSITING_SPLAT;
    const int count = MEASURE_POPPING_SETTINGS - !image;
    cJSON *rows =
        bench_report_table(r, "popping", "Changes of pixels beyond the motion, of 255", columns);
    void *memory = trip_budget_take(budget, bytes);
    if (!memory)
        return trip_fail(TRIP_ERROR, "bench", "popping",
                         "needs %zu bytes for changes, which do not fit the memory; raise "
                         "--memory or reduce --size",
                         bytes);
    measure_progress_expect(o->progress, count * (MEASURE_POPPING_STEPS + 1));
    int status =
        measure_popping_all(draw_step, scene, scene->frame.rgba, pixels, memory, count, rows);
    trip_budget_release(budget, memory, bytes);
    return status || !o->plot ? status : measure_plot_save(measure_popping_svg(rows), o->plot);
}

int bench_popping(bench_scene *scene, const bench_options *o, bench_report *r)
{
    bench_report_limit(
        r,
        "The eye turns around the object in %d steps of %g degrees of index space, through the "
        "direction with X and Y equally close to the central ray; classified %s.",
        MEASURE_POPPING_STEPS, MEASURE_POPPING_DEGREES, bench_classified(&o->settings));
    bench_report_limit(
        r, "A pixel's change is the maximum over red, green, blue (premultiplied) and alpha. Its "
           "motion is the median change over the steps. mean, 99 %% and max are of changes minus "
           "motion, over the pixels that change, in the step with the largest; motion is a mean. "
           "With clip, pixels jump where the line between two lists passes.");
    return measure(scene, o, r);
}
