/* bench accuracy: how far the pictures of settings are from the integral, and what they take. */
#include "bench_tables.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench_error.h"
#include "bench_view.h"
#include "report.h"
#include "source_field.h"

enum { PRE = -1, BY_VIEW = 0 };

/* The settings, a line each. */
static const struct row {
    const char *name;
    trip_method method;
    double h, kernel_radius;
    int slices; /* PRE: classified before interpolation; BY_VIEW: as many as the view calls for */
} rows[] = {
    { "pre, merge, h 0", TRIP_METHOD_MERGE, 0, 2, PRE },
    { "pre, merge, h 0.5", TRIP_METHOD_MERGE, 0.5, 2, PRE },
    { "pre, merge, h 0.85", TRIP_METHOD_MERGE, 0.85, 2, PRE },
    { "pre, merge, h 0.95", TRIP_METHOD_MERGE, 0.95, 2, PRE },
    { "pre, merge, h 0.99", TRIP_METHOD_MERGE, 0.99, 2, PRE },
    { "pre, clip", TRIP_METHOD_CLIP, 0, 2, PRE },
    { "pre, axis", TRIP_METHOD_AXIS, 0, 2, PRE },
    { "pre, merge, h 0.85, kernel radius 1.5", TRIP_METHOD_MERGE, 0.85, 1.5, PRE },
    { "pre, merge, h 0.85, kernel radius 2.5", TRIP_METHOD_MERGE, 0.85, 2.5, PRE },
    { "post, merge, h 0.85, slices by the view", TRIP_METHOD_MERGE, 0.85, 2, BY_VIEW },
    { "post, merge, h 0.7, slices by the view", TRIP_METHOD_MERGE, 0.7, 2, BY_VIEW },
    { "post, merge, h 0.95, slices by the view", TRIP_METHOD_MERGE, 0.95, 2, BY_VIEW },
    { "post, clip, slices by the view", TRIP_METHOD_CLIP, 0, 2, BY_VIEW },
    { "post, merge, h 0.85, 1 slice", TRIP_METHOD_MERGE, 0.85, 2, 1 },
    { "post, merge, h 0.85, 2 slices", TRIP_METHOD_MERGE, 0.85, 2, 2 },
    { "post, merge, h 0.85, 3 slices", TRIP_METHOD_MERGE, 0.85, 2, 3 },
    { "post, merge, h 0.85, 4 slices", TRIP_METHOD_MERGE, 0.85, 2, 4 },
};

enum { ROWS = sizeof rows / sizeof rows[0] };

/* What is timed and compared: a row, or the integral itself, less exactly. */
typedef struct entry {
    bench_error error, view;         /* of all views, of the last one */
    double worst_median, worst_mean; /* of a view */
    double *ms;                      /* of each frame */
    int frames;
    bool refused;  /* by the renderer */
    char why[256]; /* it was */
} entry;

typedef struct measuring {
    const session *session;
    const bench_options *options;
    bench_scene scene;
    trip_renderer *integral;
    trip_field *source; /* NULL: the integral is of the values stored */
    float *truth;
    entry entries[1 + ROWS]; /* the integral's first */
    int views;               /* done */
} measuring;

/* In turns: perspective, parallel, from inside, and wide. */
enum { KINDS_OF_VIEWS = 4 };
static const char kinds_of_views[] = "in turns perspective of 30 degrees, parallel, from inside at "
                                     "60 degrees, from near at 110 degrees; round the object";

static trip_vec3 towards(trip_vec3 from, trip_vec3 to, double share)
{
    return trip_add(from, trip_scale(trip_sub(to, from), share));
}

static trip_camera_params make_view(const measuring *m, int index)
{
    trip_camera_params v = bench_view_round(m->session, m->scene.size, index, m->options->views);
    double distance = trip_length(trip_sub(v.eye, v.look)), degree = acos(-1.0) / 180;
    switch (index % KINDS_OF_VIEWS) {
    case 1:
        v.ortho_height = 2 * distance * tan(v.fov_degrees / 2 * degree);
        break;
    case 2: {
        trip_vec3 beyond = towards(v.eye, v.look, 1.3);
        v.eye = towards(v.eye, v.look, 0.93);
        v.look = beyond;
        v.fov_degrees = 60;
        break;
    }
    case 3:
        v.eye = towards(v.eye, v.look, 0.82);
        v.fov_degrees = 110;
        break;
    default:
        break;
    }
    return v;
}

static int draw_integral(measuring *m, double tolerance, float *rgba, double *ms)
{
    const session *s = m->session;
    trip_settings settings = m->options->settings;
    trip_camera camera;
    trip_plan plan;
    trip_frame_stats stats;
    unsigned kinds = m->source ? 0 : 1u << TRIP_KIND_VOXELS | 1u << TRIP_KIND_HALO;
    bench_progress_step(m->options->progress, "integral");
    settings.tolerance = tolerance;
    double start = bench_now_ms();
    int status = trip_camera_make(&camera, &m->scene.frame.view, &s->data->index_to_world);
    if (!status)
        status = trip_plan_make_field(&plan, s->data, &camera, &settings, kinds, s->budget);
    if (status)
        return status;
    const trip_frame frame = {
        .data = s->data,
        .camera = &camera,
        .settings = &settings,
        .plan = &plan,
        .table = s->table,
        .field = m->source,
    };
    status = trip_frame_draw(m->integral, m->scene.frame.reader, &frame, rgba, NULL, &stats);
    *ms = bench_now_ms() - start;
    trip_plan_release(&plan, s->budget);
    return status;
}

static size_t pixels_of(const measuring *m)
{
    return (size_t)m->scene.size[0] * (size_t)m->scene.size[1];
}

static void compare(const measuring *m, entry *e)
{
    const float *rgba = m->scene.frame.rgba;
    e->view = (bench_error){ 0 };
    bench_error_add(&e->view, rgba, m->truth, pixels_of(m));
    bench_error_add(&e->error, rgba, m->truth, pixels_of(m));
    bench_error_figures f = bench_error_measure(&e->view);
    e->worst_median = fmax(e->worst_median, f.median);
    e->worst_mean = fmax(e->worst_mean, f.mean);
}

/* The truth of a view, and as far from it the integral at ten times the tolerance. */
static int integrate_view(measuring *m)
{
    entry *e = &m->entries[0];
    double ms;
    int status = draw_integral(m, m->options->tolerance, m->truth, &ms);
    if (!status)
        status =
            draw_integral(m, 10 * m->options->tolerance, m->scene.frame.rgba, &e->ms[e->frames++]);
    if (!status)
        compare(m, e);
    return status;
}

static trip_settings settings_of(const measuring *m, const struct row *row)
{
    trip_settings s = m->options->settings;
    s.method = row->method;
    s.h = row->h;
    s.kernel_radius = row->kernel_radius;
    if (row->slices != PRE) {
        s.classify = TRIP_CLASSIFY_POST;
        s.slices = row->slices;
    }
    return s;
}

/* Once untimed, then the runs. What the renderer refuses in its first frame is left out. */
static int draw_row(measuring *m, entry *e, const struct row *row)
{
    bench_frame frame = m->scene.frame;
    bench_cost cost;
    frame.settings = settings_of(m, row);
    bench_keep_report(e->why);
    int status = bench_frame_draw(&frame, false, &cost);
    bench_keep_report(NULL);
    if (status == TRIP_INTERRUPTED)
        return status;
    e->refused = status != 0;
    if (e->refused)
        return 0;
    compare(m, e);
    for (int run = 0; run < m->options->repeat && !status; run++) {
        status = bench_frame_draw(&frame, false, &cost);
        e->ms[e->frames++] = cost.ms;
    }
    return status;
}

/* Views are begun until the seconds given are over; one is. */
static int measure_views(measuring *m)
{
    double begin = bench_now_ms();
    int status = 0;
    for (; m->views < m->options->views && !status; m->views++) {
        if (m->views > 0 && bench_now_ms() - begin > 1e3 * m->options->budget_seconds)
            break;
        m->scene.frame.view = make_view(m, m->views);
        status = integrate_view(m);
        for (int i = 0; i < ROWS && !status; i++)
            if (!m->entries[1 + i].refused)
                status = draw_row(m, &m->entries[1 + i], &rows[i]);
    }
    return status;
}

static const bench_column columns[] = {
    { "settings", "settings", 0, 0 }, { "median", "median", 2, 0 },
    { "mean", "mean", 2, 0 },         { "worst_median", "of the worst view", 2, 0 },
    { "worst_mean", "mean", 2, 0 },   { "percentile_99", "99 %", 2, 0 },
    { "most", "most", 2, 0 },         { "psnr", "PSNR, dB", 1, 0 },
    { "ms", "median ms", 1, 0 },
};

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void add_row(cJSON *table, const char *name, entry *e)
{
    const bench_error_figures f = bench_error_measure(&e->error);
    cJSON *row = cJSON_CreateObject();
    qsort(e->ms, (size_t)e->frames, sizeof *e->ms, ascending);
    cJSON_AddStringToObject(row, "settings", name);
    cJSON_AddNumberToObject(row, "median", f.median);
    cJSON_AddNumberToObject(row, "mean", f.mean);
    cJSON_AddNumberToObject(row, "worst_median", e->worst_median);
    cJSON_AddNumberToObject(row, "worst_mean", e->worst_mean);
    cJSON_AddNumberToObject(row, "percentile_99", f.percentile_99);
    cJSON_AddNumberToObject(row, "most", f.most);
    cJSON_AddNumberToObject(row, "psnr", f.psnr); /* null where infinite */
    cJSON_AddNumberToObject(row, "ms", e->ms[(e->frames - 1) / 2]);
    cJSON_AddNumberToObject(row, "channels", (double)e->error.count);
    cJSON_AddItemToArray(table, row);
}

static void add_table(measuring *m, bench_report *r)
{
    cJSON *table = bench_report_table(r, "accuracy", "Distance from the integral, of 255", columns,
                                      sizeof columns / sizeof columns[0]);
    add_row(table, "integral, ten times the tolerance", &m->entries[0]);
    for (int i = 0; i < ROWS; i++)
        if (m->entries[1 + i].refused)
            bench_report_limit(r, "Left out: %s: %s", rows[i].name, m->entries[1 + i].why);
        else
            add_row(table, rows[i].name, &m->entries[1 + i]);
}

static void add_limits(const measuring *m, bench_report *r)
{
    bench_report_limit(r,
                       "The truth is the integral through the values %s, interpolated linearly, "
                       "one ray a pixel, to a tolerance of %g (%.2g of 255); what storing loses is "
                       "in %s figure.",
                       m->source ? "of the source volume" : "that the data set stores",
                       m->options->tolerance, 255 * m->options->tolerance,
                       m->source ? "every" : "no");
    bench_report_limit(r, "Errors are of red, green, blue (premultiplied) and alpha over the "
                          "pixels that the object covers, where alpha of either picture is above "
                          "1/255, all views together; median and 99 %% to 0.01.");
    bench_report_limit(r, "With pre, splats are composited %s.",
                       m->options->settings.compositing == TRIP_COMPOSITING_SHEET ? "sheet by sheet"
                                                                                  : "one by one");
    bench_report_limit(r, "Views: %d, %s.", m->views, kinds_of_views);
    bench_report_limit(r, "A frame is planning, drawing from memory and merging; the first of a "
                          "view is untimed. The integral's first frame also gathers the volume.");
}

static int begin(measuring *m, bench_report *r)
{
    const session *s = m->session;
    const bench_options *o = m->options;
    size_t frames = (size_t)o->views * (size_t)o->repeat;
    int status = bench_scene_open(&m->scene, s, o, r);
    if (!status)
        status = session_take_image(s, m->scene.size[0], m->scene.size[1], &m->truth);
    if (!status)
        status = trip_integral_create(&m->integral, s->budget, (unsigned)o->threads[0]);
    if (!status && o->source)
        status = trip_source_field_read(&m->source, s->data, o->source, &(trip_volume_params){ 0 },
                                        s->budget);
    for (int i = 0; i < 1 + ROWS && !status; i++)
        if (!(m->entries[i].ms = calloc(frames, sizeof *m->entries[i].ms)))
            status = trip_fail(TRIP_ERROR, "bench", "accuracy", "out of memory");
    return status;
}

static void end(measuring *m)
{
    for (int i = 0; i < 1 + ROWS; i++)
        free(m->entries[i].ms);
    bench_renderer_destroy(m->integral);
    trip_field_destroy(m->source);
    session_release_image(m->session, m->scene.size[0], m->scene.size[1], m->truth);
    bench_scene_close(&m->scene);
    free(m);
}

int bench_accuracy(const session *s, const bench_options *o, bench_report *r)
{
    measuring *m = calloc(1, sizeof *m);
    bench_options own = *o;
    if (!m)
        return trip_fail(TRIP_ERROR, "bench", "accuracy", "out of memory");
    own.settings.background[3] = 0;
    m->session = s;
    m->options = &own;
    bench_progress_expect(o->progress, 1 + o->views * (2 + ROWS * (1 + o->repeat)));
    int status = begin(m, r);
    if (!status)
        status = measure_views(m);
    if (!status) {
        add_limits(m, r);
        add_table(m, r);
    }
    end(m);
    return status;
}
