/* bench popping: measures the jump of pixels while the camera turns through the change of the
 * dominant axis. */
#include "bench_tables.h"

#include "bench_popping.h"
#include "bench_view.h"
#include "report.h"

static int draw_steps(const session *s, const bench_scene *scene, const trip_settings *drawn,
                      bench_popping_changes *p)
{
    bench_frame frame = scene->frame;
    bench_cost cost;
    int status = 0;
    frame.settings = *drawn;
    for (int i = 0; i <= BENCH_POPPING_STEPS && !status; i++) {
        frame.view = bench_view_between(s, scene->size, bench_popping_degrees(i));
        status = bench_frame_draw(&frame, false, &cost);
        bench_popping_add(p, i, frame.rgba);
    }
    return status;
}

static const bench_column columns[] = {
    { "settings", "settings", 0, 0 },  { "mean", "mean", 3, 0 },
    { "percentile_99", "99 %", 3, 0 }, { "max", "max", 2, 0 },
    { "motion", "motion", 3, 0 },
};

static void add_row(cJSON *table, const char *name, const bench_popping_row *f)
{
    cJSON *row = cJSON_CreateObject();
    cJSON_AddStringToObject(row, "settings", name);
    cJSON_AddNumberToObject(row, "mean", f->mean);
    cJSON_AddNumberToObject(row, "percentile_99", f->percentile_99);
    cJSON_AddNumberToObject(row, "max", f->max);
    cJSON_AddNumberToObject(row, "motion", f->motion);
    cJSON_AddItemToArray(table, row);
}

static int measure(const session *s, const bench_scene *scene, const bench_options *o,
                   bench_popping_changes *p, bench_report *r)
{
    cJSON *table = bench_report_table(r, "popping", "Changes of pixels beyond the motion, of 255",
                                      columns, sizeof columns / sizeof columns[0]);
    bench_popping_row rows[BENCH_POPPING_SETTINGS] = { 0 };
    const trip_renderer_ops *ops = scene->frame.renderer->ops;
    const bool image = ops->forms & TRIP_DRAWS_IMAGE_SHEETS &&
                       o->settings.classify == TRIP_CLASSIFY_PRE &&
                       o->settings.compositing == TRIP_COMPOSITING_SPLAT;
    const int count = image ? BENCH_POPPING_SETTINGS : BENCH_POPPING_SETTINGS - 1;
    int status = 0;
    for (int i = 0; i < count && !status; i++) {
        const bench_popping_setting *one = &bench_popping_settings[i];
        trip_settings drawn = o->settings;
        drawn.background[3] = 0;
        drawn.method = (trip_method)(one->method - TRIPTYCH_METHOD_MERGE);
        drawn.h = one->h;
        status = draw_steps(s, scene, &drawn, p);
        if (status)
            break;
        bench_popping_find(p, one, &rows[i]);
        add_row(table, one->name, &rows[i]);
    }
    return status || !o->plot ? status : bench_popping_plot(o->plot, rows, count);
}

static void add_limits(const bench_options *o, bench_report *r)
{
    bench_report_limit(
        r,
        "The eye turns around the object in %d steps of %g degrees of index space, through the "
        "direction with X and Y equally close to the central ray; classified %s.",
        BENCH_POPPING_STEPS, bench_popping_degrees(1) - bench_popping_degrees(0),
        o->settings.classify == TRIP_CLASSIFY_POST          ? "post"
        : o->settings.compositing == TRIP_COMPOSITING_SHEET ? "pre, by sheets"
                                                            : "pre, by splats");
    bench_report_limit(
        r, "A pixel's change is the maximum over red, green, blue (premultiplied) and alpha. Its "
           "motion is the median change over the steps. mean, 99 %% and max are of changes minus "
           "motion, over the pixels that change, in the step with the largest; motion is a mean. "
           "With clip, pixels jump where the line between two lists passes.");
}

int bench_popping(const session *s, const bench_options *o, bench_report *r)
{
    bench_scene scene;
    bench_popping_changes p = { 0 };
    bench_progress_expect(o->progress, BENCH_POPPING_SETTINGS * (BENCH_POPPING_STEPS + 1));
    int status = bench_scene_open(&scene, s, o, r);
    const size_t pixels = (size_t)scene.size[0] * (size_t)scene.size[1];
    if (!status && !bench_popping_begin(&p, s->budget, pixels))
        status = trip_fail(TRIP_ERROR, "bench", "popping",
                           "needs %zu bytes for changes, which do not fit the memory; raise "
                           "--memory or reduce --size",
                           bench_popping_bytes(pixels));
    if (!status)
        status = measure(s, &scene, o, &p, r);
    if (!status)
        add_limits(o, r);
    bench_popping_end(&p);
    bench_scene_close(&scene);
    return status;
}
