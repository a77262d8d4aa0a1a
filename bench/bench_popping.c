/* bench popping: how much pixels jump while the camera turns through the change of the axis that
 * rays are most aligned with. */
#include "bench_tables.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench_popping.h"
#include "bench_view.h"
#include "report.h"

/* The settings, a line each, in the plot's order. */
static const struct setting {
    const char *name, *label;
    trip_method method;
    double h;
} settings[] = {
    { "merge, h 0", "0", TRIP_METHOD_MERGE, 0 },
    { "merge, h 0.5", "0.5", TRIP_METHOD_MERGE, 0.5 },
    { "merge, h 0.85", "0.85", TRIP_METHOD_MERGE, 0.85 },
    { "merge, h 0.95", "0.95", TRIP_METHOD_MERGE, 0.95 },
    { "merge, h 0.99", "0.99", TRIP_METHOD_MERGE, 0.99 },
    { "clip", "clip", TRIP_METHOD_CLIP, 0 },
    { "axis", "axis", TRIP_METHOD_AXIS, 0 },
    { "image", "image", TRIP_METHOD_IMAGE, 0 }, /* splats, by renderers that have it */
};

enum { ROWS = sizeof settings / sizeof settings[0], STEPS = 40 };

static const double step_degrees = 0.05;

/* A pixel's change in a step is that of the component that changes most. What the motion changes is
 * the median of the pixel's changes over the steps: a jump takes one of them. */
typedef struct measuring {
    const session *session;
    bench_scene scene;
    size_t pixels;
    float *before;           /* the picture of the step before */
    float (*changes)[STEPS]; /* by pixel */
    float *sorted;           /* room for the changes of a step */
} measuring;

static int ascending(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static float change_of(const float a[4], const float b[4])
{
    float most = 0;
    for (int c = 0; c < 4; c++)
        most = fmaxf(most, fabsf(a[c] - b[c]));
    return most;
}

/* Draws all steps; the changes from one to the next stay. */
static int draw_steps(measuring *m, const trip_settings *drawn)
{
    bench_frame frame = m->scene.frame;
    bench_cost cost;
    int status = 0;
    frame.settings = *drawn;
    for (int i = 0; i <= STEPS && !status; i++) {
        frame.view =
            bench_view_between(m->session, m->scene.size, 45 + step_degrees * (i - 0.5 * STEPS));
        status = bench_frame_draw(&frame, false, &cost);
        for (size_t p = 0; p < m->pixels && i > 0; p++)
            m->changes[p][i - 1] = change_of(&frame.rgba[4 * p], &m->before[4 * p]);
        memcpy(m->before, frame.rgba, 4 * m->pixels * sizeof *m->before);
    }
    return status;
}

/* Leaves the changes beyond the motion of those pixels that change, which come first; returns how
 * many they are. */
static size_t take_motion(measuring *m, double *mean)
{
    size_t kept = 0;
    double sum = 0;
    for (size_t p = 0; p < m->pixels; p++) {
        float sorted[STEPS];
        memcpy(sorted, m->changes[p], sizeof sorted);
        qsort(sorted, STEPS, sizeof *sorted, ascending);
        if (!(sorted[STEPS - 1] > 0))
            continue;
        float motion = sorted[STEPS / 2];
        for (int i = 0; i < STEPS; i++)
            m->changes[kept][i] = fmaxf(0, m->changes[p][i] - motion);
        sum += (double)motion;
        kept++;
    }
    *mean = kept ? sum / (double)kept : 0;
    return kept;
}

static void find_figures(measuring *m, bench_popping_row *f)
{
    size_t count = take_motion(m, &f->motion);
    f->motion *= 255;
    for (int i = 0; i < STEPS && count > 0; i++) {
        double sum = 0;
        for (size_t p = 0; p < count; p++)
            sum += (double)(m->sorted[p] = m->changes[p][i]);
        qsort(m->sorted, count, sizeof *m->sorted, ascending);
        f->mean = fmax(f->mean, 255 * sum / (double)count);
        f->most = fmax(f->most, 255 * (double)m->sorted[count - 1]);
        f->percentile_99 = fmax(f->percentile_99, 255 * (double)m->sorted[(count - 1) * 99 / 100]);
    }
}

static const bench_column columns[] = {
    { "settings", "settings", 0, 0 },  { "mean", "mean", 3, 0 },
    { "percentile_99", "99 %", 3, 0 }, { "most", "most", 2, 0 },
    { "motion", "motion", 3, 0 },
};

static void add_row(cJSON *table, const char *name, const bench_popping_row *f)
{
    cJSON *row = cJSON_CreateObject();
    cJSON_AddStringToObject(row, "settings", name);
    cJSON_AddNumberToObject(row, "mean", f->mean);
    cJSON_AddNumberToObject(row, "percentile_99", f->percentile_99);
    cJSON_AddNumberToObject(row, "most", f->most);
    cJSON_AddNumberToObject(row, "motion", f->motion);
    cJSON_AddItemToArray(table, row);
}

static int measure(measuring *m, const bench_options *o, bench_report *r)
{
    cJSON *table = bench_report_table(r, "popping", "Changes of pixels beyond the motion, of 255",
                                      columns, sizeof columns / sizeof columns[0]);
    bench_popping_row rows[ROWS] = { 0 };
    const trip_renderer_ops *ops = m->scene.frame.renderer->ops;
    const bool image = ops->forms & TRIP_DRAWS_IMAGE_SHEETS &&
                       o->settings.classify == TRIP_CLASSIFY_PRE &&
                       o->settings.compositing == TRIP_COMPOSITING_SPLAT;
    const int count = image ? ROWS : ROWS - 1;
    int status = 0;
    for (int i = 0; i < count && !status; i++) {
        trip_settings drawn = o->settings;
        drawn.background[3] = 0;
        drawn.method = settings[i].method;
        drawn.h = settings[i].h;
        status = draw_steps(m, &drawn);
        if (status)
            break;
        rows[i].label = settings[i].label;
        rows[i].has_h = settings[i].method == TRIP_METHOD_MERGE;
        find_figures(m, &rows[i]);
        add_row(table, settings[i].name, &rows[i]);
    }
    return status || !o->plot ? status : bench_popping_plot(o->plot, rows, count);
}

static void add_limits(const bench_options *o, bench_report *r)
{
    bench_report_limit(r,
                       "The eye goes round the object in %d steps of %g degrees of index space, "
                       "through where X and Y are equally near to the ray at the image's centre; "
                       "classified %s.",
                       STEPS, step_degrees,
                       o->settings.classify == TRIP_CLASSIFY_POST          ? "post"
                       : o->settings.compositing == TRIP_COMPOSITING_SHEET ? "pre, by sheets"
                                                                           : "pre, by splats");
    bench_report_limit(r, "Of a pixel's change from one step to the next, red, green, blue "
                          "(premultiplied) or alpha, whichever is most, the median over the steps "
                          "is taken as the motion's. Figures are over the pixels that change at "
                          "all, each of the step where it is most; with clip what jumps are the "
                          "pixels that the line between two lists passes.");
}

int bench_popping(const session *s, const bench_options *o, bench_report *r)
{
    measuring m = { .session = s };
    bench_progress_expect(o->progress, ROWS * (STEPS + 1));
    int status = bench_scene_open(&m.scene, s, o, r);
    m.pixels = (size_t)m.scene.size[0] * (size_t)m.scene.size[1];
    const size_t bytes[] = { 4 * m.pixels * sizeof *m.before, m.pixels * sizeof *m.changes,
                             m.pixels * sizeof *m.sorted };
    if (!status) {
        m.before = trip_budget_take(s->budget, bytes[0]);
        m.changes = trip_budget_take(s->budget, bytes[1]);
        m.sorted = trip_budget_take(s->budget, bytes[2]);
        if (!m.before || !m.changes || !m.sorted)
            status = trip_fail(TRIP_ERROR, "bench", "popping",
                               "%zu bytes of changes do not fit the memory given; raise --memory "
                               "or measure smaller pictures",
                               bytes[0] + bytes[1] + bytes[2]);
    }
    if (!status)
        status = measure(&m, o, r);
    if (!status)
        add_limits(o, r);
    trip_budget_release(s->budget, m.before, bytes[0]);
    trip_budget_release(s->budget, m.changes, bytes[1]);
    trip_budget_release(s->budget, m.sorted, bytes[2]);
    bench_scene_close(&m.scene);
    return status;
}
