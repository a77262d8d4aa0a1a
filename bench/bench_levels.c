/* bench levels: measures the error of each coarse level with voxels one pixel wide. It also
 * measures the flicker of pictures while the eye moves away through the levels. Without a data
 * set it measures one object that is sampled more and more finely (bench_finer.c). */
#include "bench_tables.h"

#include <math.h>
#include <stdlib.h>

#include "bench_context.h"
#include "error.h"
#include "report.h"

enum {
    /* Minimum number of reference pixels along each side of a pixel. */
    MIN_SAMPLES = 4,
    /* Maximum reference pixels along a side. Levels with a larger reference are left out. */
    MAX_TRUTH_PX = 4096,
    DOLLY_STEPS = 128,
    DOLLY_PX = 192,
    TOO_LARGE = 1,
    STEPS_OF_VIEW = 6, /* frames of a level and a view */
};

/* The eye starts where voxels of level 0 are dolly_px wide, and ends dolly_times times as far
 * away. */
static const double dolly_px = 0.8, dolly_times = 2;

typedef struct measuring {
    const bench_options *options;
    bench_context context;
    double voxel; /* width in world units */
    unsigned levels;
    int width; /* of the picture of a level */
    bench_report *report;
} measuring;

/* ---- levels ---- */

/* settings.lod_px that selects the level with voxels one pixel wide. */
static const double level_px = 1.0001;

/* The errors of colour and alpha of a level, summed over views. */
typedef struct entry {
    measure_error drawn[2]; /* with one ray per pixel */
    measure_error own[2];   /* with as many rays as the reference */
    measure_error fine[2];  /* finest level at this size, with one ray per pixel */
    double ms, fine_ms;     /* sums over the views */
} entry;

/* Sets a parallel view of the whole object, with voxels of a level one pixel wide. */
static int look_at(measuring *m, int view, unsigned level, triptych_camera *camera)
{
    const double pixel = ldexp(m->voxel, (int)level);
    const triptych_view whole = { .width = 64,
                                  .height = 64,
                                  .azimuth_degrees = 360.0 * view / m->options->views,
                                  .ortho_fit = 1,
                                  .turntable = 1 };
    int status = bench_context_find(&m->context, &whole, camera);
    if (status)
        return status;
    camera->width = camera->height = (int)ceil(camera->ortho_height / pixel);
    camera->ortho_height = camera->height * pixel;
    return bench_context_look(&m->context, camera);
}

static int samples_of(unsigned level)
{
    return (1 << level) > MIN_SAMPLES ? 1 << level : MIN_SAMPLES;
}

/* Draws the view and adds its errors. With `ms`, adds the time of a second frame. */
static int draw_and_compare(measuring *m, double lod_px, int samples, const float *truth,
                            float *rgba, double *ms, measure_error errors[2])
{
    const size_t pixels = (size_t)m->width * (size_t)m->width;
    double own_ms;
    int status = bench_context_draw(&m->context, lod_px, samples, rgba, NULL);
    if (!status && ms)
        status = bench_context_draw(&m->context, lod_px, samples, rgba, &own_ms);
    if (!status)
        measure_error_add_apart(&errors[0], &errors[1], rgba, truth, pixels);
    if (!status && ms)
        *ms += own_ms;
    return status;
}

/* Returns TOO_LARGE if the reference would be too large. */
static int measure_view(measuring *m, int view, unsigned level, entry *e)
{
    triptych_camera camera;
    float *truth = NULL, *rgba = NULL;
    int status = look_at(m, view, level, &camera);
    if (status)
        return status;
    m->width = camera.width;
    if (camera.width > MAX_TRUTH_PX / samples_of(level))
        return TOO_LARGE;
    status = bench_context_picture(&m->context, m->width, m->width, &truth);
    if (!status)
        status = bench_context_picture(&m->context, m->width, m->width, &rgba);
    if (!status)
        status = bench_context_draw(&m->context, 0, samples_of(level), truth, NULL);
    if (!status)
        status = draw_and_compare(m, 0, 1, truth, rgba, &e->fine_ms, e->fine);
    if (!status)
        status = draw_and_compare(m, level_px, samples_of(level), truth, rgba, NULL, e->own);
    if (!status)
        status = draw_and_compare(m, level_px, 1, truth, rgba, &e->ms, e->drawn);
    triptych_release_picture(m->context.t, truth);
    triptych_release_picture(m->context.t, rgba);
    return status;
}

static const measure_column level_columns[] = {
    { "level", "level", 0, 0 },
    { "width", "pixels", 0, 0 },
    { "colour_mean", "colour: mean", 2, 0 },
    { "colour_99", "99 %", 1, 0 },
    { "alpha_mean", "alpha: mean", 2, 0 },
    { "alpha_99", "99 %", 1, 0 },
    { "ms", "ms", 1, 0 },
    { "own_colour_mean", "reference rays: colour", 2, 0 },
    { "own_alpha_mean", "alpha", 2, 0 },
    { "fine_colour_mean", "finest: colour", 2, 0 },
    { "fine_alpha_mean", "alpha", 2, 0 },
    { "fine_ms", "ms", 1, 0 },
};

static void add_level(const measuring *m, cJSON *table, unsigned level, const entry *e)
{
    const measure_error_figures colour = measure_error_measure(&e->drawn[0]);
    const measure_error_figures alpha = measure_error_measure(&e->drawn[1]);
    cJSON *row = measure_new_row(table);
    measure_add(row, { "level", level }, { "width", m->width }, { "colour_mean", colour.mean },
                { "colour_99", colour.percentile_99 }, { "alpha_mean", alpha.mean },
                { "alpha_99", alpha.percentile_99 }, { "ms", e->ms / m->options->views },
                { "own_colour_mean", measure_error_measure(&e->own[0]).mean },
                { "own_alpha_mean", measure_error_measure(&e->own[1]).mean },
                { "fine_colour_mean", measure_error_measure(&e->fine[0]).mean },
                { "fine_alpha_mean", measure_error_measure(&e->fine[1]).mean },
                { "fine_ms", e->fine_ms / m->options->views });
}

static int measure_levels(measuring *m)
{
    cJSON *table = bench_report_table(
        m->report, "levels", "Each level with voxels one pixel wide: error of 255", level_columns);
    int status = 0, steps = (int)m->levels * m->options->views * STEPS_OF_VIEW;
    entry *e = malloc(sizeof *e);
    if (!e)
        return trip_fail(TRIP_ERROR, "bench", "levels", "out of memory");
    for (unsigned level = 1; level <= m->levels && !status; level++) {
        *e = (entry){ 0 };
        for (int view = 0; view < m->options->views && !status; view++) {
            status = measure_view(m, view, level, e);
            steps -= status ? 0 : STEPS_OF_VIEW;
        }
        if (!status)
            add_level(m, table, level, e);
    }
    free(e);
    measure_progress_expect(m->options->progress, -steps); /* of levels left out */
    return status == TOO_LARGE ? 0 : status;
}

/* ---- dolly ---- */

/* Mean changes between consecutive pictures, of 255. */
typedef struct flicker {
    double changes[DOLLY_STEPS];
} flicker;

static double change(const float *a, const float *b, size_t pixels)
{
    double sum = 0;
    for (size_t i = 0; i < 4 * pixels; i++)
        sum += fabs((double)a[i] - (double)b[i]);
    return 255 * sum / (4 * (double)pixels);
}

/* Sets the view of a step. The distance grows by the same factor in each step. */
static int look_from(measuring *m, const triptych_camera *from, int step)
{
    triptych_camera camera = *from;
    const double times = pow(dolly_times, (double)step / DOLLY_STEPS);
    for (int a = 0; a < 3; a++)
        camera.eye[a] = from->look[a] + times * (from->eye[a] - from->look[a]);
    return bench_context_look(&m->context, &camera);
}

/* Computes the distance with voxels dolly_px wide in the middle of the picture. */
static int find_start(measuring *m, triptych_camera *from)
{
    const triptych_view whole = { .width = DOLLY_PX, .height = DOLLY_PX, .fov_degrees = 30 };
    int status = bench_context_find(&m->context, &whole, from);
    if (status)
        return status;
    const double wanted =
        m->voxel * DOLLY_PX / dolly_px / 2 / tan(30 * 3.14159265358979323846 / 360);
    double distance = 0;
    for (int a = 0; a < 3; a++)
        distance = hypot(distance, from->eye[a] - from->look[a]);
    for (int a = 0; a < 3; a++)
        from->eye[a] = from->look[a] + wanted / distance * (from->eye[a] - from->look[a]);
    return 0;
}

static int dolly(measuring *m, const triptych_camera *from, double lod_px, float *pictures[2],
                 flicker *f)
{
    const size_t pixels = (size_t)DOLLY_PX * DOLLY_PX;
    int status = 0;
    for (int step = 0; step <= DOLLY_STEPS && !status; step++) {
        status = look_from(m, from, step);
        if (!status)
            status = bench_context_draw(&m->context, lod_px, 1, pictures[step % 2], NULL);
        if (step > 0 && !status)
            f->changes[step - 1] = change(pictures[0], pictures[1], pixels);
    }
    return status;
}

static const measure_column dolly_columns[] = {
    { "drawn", "drawn", 0, 0 },
    { "mean", "mean", 3, 0 },
    { "max", "max", 3, 0 },
    { "mean_of_finest", "x finest", 2, 0 },
    { "most_of_finest", "maximum", 2, 0 },
};

static void add_dolly(cJSON *table, const char *drawn, const flicker *f, const flicker *finest)
{
    double sum = 0, max = 0, sum_of_finest = 0, max_of_finest = 0;
    cJSON *row = measure_new_row(table);
    for (int i = 0; i < DOLLY_STEPS; i++) {
        sum += f->changes[i];
        max = fmax(max, f->changes[i]);
        sum_of_finest += finest->changes[i];
        max_of_finest = fmax(max_of_finest, f->changes[i] / finest->changes[i]);
    }
    cJSON_AddStringToObject(row, "drawn", drawn);
    measure_add(row, { "mean", sum / DOLLY_STEPS }, { "max", max },
                { "mean_of_finest", sum / sum_of_finest }, { "most_of_finest", max_of_finest });
}

static int measure_dolly(measuring *m)
{
    cJSON *table = bench_report_table(m->report, "dolly",
                                      "Change between consecutive pictures, of 255", dolly_columns);
    triptych_camera from;
    flicker finest, coarse;
    float *pictures[2] = { NULL, NULL };
    int status = find_start(m, &from);
    for (int i = 0; i < 2 && !status; i++)
        status = bench_context_picture(&m->context, DOLLY_PX, DOLLY_PX, &pictures[i]);
    if (!status)
        status = dolly(m, &from, 0, pictures, &finest);
    if (!status)
        status = dolly(m, &from, 1, pictures, &coarse);
    if (status)
        return status;
    add_dolly(table, "finest", &finest, &finest);
    add_dolly(table, "--lod 1", &coarse, &finest);
    return 0;
}

static void add_limits(const measuring *m)
{
    bench_report_limit(
        m->report,
        "The reference of a level is the finest level with at least %d x %d rays per pixel, and at "
        "least one per voxel, averaged. Levels with a reference wider than %d pixels are left out. "
        "The %d views around the object are parallel. Colour is premultiplied; means and 99 %% are "
        "over the pixels that the object covers. reference rays: the level drawn with as many rays "
        "as the reference.",
        MIN_SAMPLES, MIN_SAMPLES, MAX_TRUTH_PX, m->options->views);
    bench_report_limit(m->report,
                       "The eye moves away from the middle of the object in %d steps. Voxels of "
                       "the finest level are %g pixels wide at first and %g at last. x finest is "
                       "the ratio of the means; maximum is the largest ratio in one step.",
                       DOLLY_STEPS, dolly_px, dolly_px / dolly_times);
}

int bench_levels(const session *s, const bench_options *o, bench_report *r)
{
    if (!s)
        return bench_finer(o, r);
    measuring m = { .options = o, .report = r };
    int status = bench_context_open(&m.context, o->input, o);
    if (!status)
        status = bench_context_voxel(&m.context, &m.voxel);
    if (!status)
        status = bench_context_levels(&m.context, &m.levels);
    if (!status && m.levels == 0)
        status =
            trip_fail(TRIP_ERROR, "bench", o->input,
                      "has no coarse levels for %s; `triptych brick --levels-for both` makes them",
                      o->settings.classify == TRIP_CLASSIFY_POST ? "post" : "pre");
    measure_progress_expect(o->progress,
                            (int)m.levels * o->views * STEPS_OF_VIEW + 2 * (DOLLY_STEPS + 1));
    if (!status)
        status = measure_levels(&m);
    if (!status)
        status = measure_dolly(&m);
    if (!status)
        add_limits(&m);
    bench_context_close(&m.context);
    return status;
}
