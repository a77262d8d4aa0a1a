#include "measure.h"

#include <cjson/cJSON.h>
#include <fnmatch.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "progress_line.h"
#include "contexts.h"
#include "flip.h"
#include "json.h"
#include "command_line.h"
#include "picture_data.h"
#include "report.h"
#include "ssim.h"
#include "vtk.h"

enum { THUMBNAIL_PX = 128 };

/* The share of the pixels that `render --error` promises. */
#define PROMISED_SHARE 0.99

/* Pictures of a view. */
typedef enum which {
    TRUTH,
    ALONG,     /* integral of the truth's volume along the rays of a row */
    STORED,    /* integral of the values in a data set */
    FIELD,     /* integral of the drawn field: splats, or values by another kernel */
    FINE,      /* reference at the finest level */
    REFERENCE, /* reference at the drawn levels */
    RAN,
    PICTURES
} which;

typedef struct sweep {
    accuracy_measured *m;
    const accuracy_options *o;
    accuracy_contexts contexts;
    draw_settings defaults;
    measure_progress *progress;
    float *pictures[PICTURES];
    size_t picture_bytes;
    double begin;
    int rows_left;          /* rows that the next view measures */
    double truth_seconds;   /* time of the integral over pixels in the first view */
    double truth_covered;   /* share of the pixels that the object covers there */
    double along_seconds;   /* time of an integral along one ray per pixel */
    double compare_seconds; /* time of one comparison with the truth */
    /* Data sets and settings of the pictures STORED, FIELD and REFERENCE; -1 if there is no
     * picture. */
    int stored_data, field_data, reference_data;
    int along_rays, stored_rays; /* along each side of a pixel, of the pictures ALONG and STORED */
    draw_settings field;         /* only the settings that change the integral */
    draw_settings reference;
    measure_error view; /* scratch memory */
} sweep;

static bool is_over(const sweep *s)
{
    return trip_now_seconds() - s->begin > s->o->budget_seconds;
}

static size_t pixels_of(const sweep *s)
{
    return (size_t)s->o->width * (size_t)s->o->height;
}

/* ---- rows ---- */

static bool is_wanted(const char *patterns, const char *name)
{
    char one[ACCURACY_NAME_BYTES];
    for (const char *rest = patterns; rest;) {
        size_t length = strcspn(rest, ",");
        snprintf(one, sizeof one, "%.*s", (int)(length < sizeof one ? length : sizeof one - 1),
                 rest);
        if (fnmatch(one, name, 0) == 0)
            return true;
        rest = rest[length] ? rest + length + 1 : NULL;
    }
    return false;
}

static int add_row(accuracy_measured *m, int data, const accuracy_setting *setting)
{
    accuracy_row *row = &m->rows[m->row_count];
    size_t frames = (size_t)m->options->views * (size_t)m->options->repeat;
    *row = (accuracy_row){ .setting = *setting, .data = data, .splats_drawn = -1 };
    row->ms = calloc(frames, sizeof *row->ms);
    m->row_count++;
    return row->ms ? 0 : trip_fail(TRIP_ERROR, "accuracy", setting->name, "out of memory");
}

/* Adds rows for the other data sets, by post and by pre. */
static int add_others(accuracy_measured *m, const draw_settings *defaults)
{
    int status = 0;
    for (int d = 1; d < m->options->data_count && !status; d++)
        for (int pre = 0; pre < 2 && !status; pre++) {
            accuracy_setting one = { .renderer = TRIPTYCH_RENDERER_CPU,
                                     .settings = accuracy_setting_fixed(
                                         defaults,
                                         pre ? TRIPTYCH_CLASSIFY_PRE : TRIPTYCH_CLASSIFY_POST) };
            const char *slash = strrchr(m->options->data[d], '/');
            snprintf(one.name, sizeof one.name, "%s-%.30s", pre ? "pre" : "post",
                     slash && slash[1] ? slash + 1 : m->options->data[d]);
            if (m->options->usual || is_wanted(m->options->settings, one.name))
                status = add_row(m, d, &one);
        }
    return status;
}

static int add_program(accuracy_measured *m, const char *name, const char *command)
{
    accuracy_setting one = { 0 };
    snprintf(one.name, sizeof one.name, "%s", name);
    int status = add_row(m, 0, &one);
    accuracy_row *row = &m->rows[m->row_count - 1];
    if (!status && !(row->program = calloc(1, sizeof *row->program)))
        status = trip_fail(TRIP_ERROR, "accuracy", one.name, "out of memory");
    if (!status)
        *row->program = (accuracy_program){ .socket = -1, .command = command };
    return status;
}

/* Adds the other programs: the given ones, else VTK's ray caster. Each starts with the first
 * view. */
static int add_programs(accuracy_measured *m)
{
    const accuracy_options *o = m->options;
    int status = 0;
    for (int i = 0; i < o->program_count && !status; i++) {
        char name[ACCURACY_NAME_BYTES];
        snprintf(name, sizeof name, "program-%d", i + 1);
        status = add_program(m, name, o->program[i]);
    }
    if (!status && !o->program_count && !o->no_programs && o->source &&
        is_wanted(o->settings, "vtk") && accuracy_vtk_command(o->source, m->vtk, sizeof m->vtk)) {
        status = add_program(m, "vtk", m->vtk);
        m->rows[m->row_count - 1].is_vtk = true;
    }
    return status;
}

static int add_rows(accuracy_measured *m, const draw_settings *defaults)
{
    accuracy_setting all[ACCURACY_SETTINGS_MAX];
    int count = accuracy_settings(all, defaults), status = 0;
    if (!(m->rows = calloc(ACCURACY_ROWS_MAX, sizeof *m->rows)) ||
        !(m->views = calloc((size_t)m->options->views, sizeof *m->views)))
        return trip_fail(TRIP_ERROR, "accuracy", "rows", "out of memory");
    for (int i = 0; i < count && !status; i++)
        if (is_wanted(m->options->settings, all[i].name))
            status = add_row(m, 0, &all[i]);
    if (!status)
        status = add_others(m, defaults);
    if (!status)
        status = add_programs(m);
    for (int i = 0; i < ACCURACY_POPPINGS; i++)
        if (is_wanted(m->options->settings, accuracy_poppings[i].name))
            m->popping[m->popping_count++] = accuracy_poppings[i];
    if (!status && !m->row_count && !m->popping_count)
        return trip_fail(TRIP_USAGE, "usage", "--settings",
                         "\"%s\" matches no setting; `triptych accuracy --list` prints the names",
                         m->options->settings);
    return status;
}

__attribute__((format(printf, 2, 3))) static void leave_out(accuracy_row *row, const char *why, ...)
{
    va_list arguments;
    va_start(arguments, why);
    vsnprintf(row->why, sizeof row->why, why, arguments);
    va_end(arguments);
    row->state = ACCURACY_LEFT_OUT;
}

/* A row that fails in a view leaves out its steps in the later views. */
static void drop_steps(sweep *s, int view)
{
    s->rows_left--;
    measure_progress_expect(s->progress, -(s->o->views - view - 1));
}

/* Returns whether the data set has coarse levels for a setting. */
static bool has_levels(triptych *t, const draw_settings *settings)
{
    unsigned levels;
    return triptych_count_levels(t, draw_settings_classify(settings), &levels) == 0 && levels > 0;
}

/* Reads the --levels-for of the data set from its notes. */
static void note_levels(accuracy_measured *m, const char *notes)
{
    static const char option[] = "--levels-for=";
    const cJSON *one;
    trip_json json = { 0 };
    snprintf(m->levels_for, sizeof m->levels_for, "%s", trip_levels_for_names[0]);
    if (trip_json_parse(&json, notes, m->options->data[0], NULL) != 0)
        return;
    cJSON_ArrayForEach(one, cJSON_GetObjectItemCaseSensitive(json.root, "source_options"))
    {
        const char *text = cJSON_GetStringValue(one);
        if (text && !strncmp(text, option, sizeof option - 1))
            snprintf(m->levels_for, sizeof m->levels_for, "%s", text + sizeof option - 1);
    }
    trip_json_free(&json);
}

/* Returns the message without the path at its beginning. */
static const char *without_path(const char *why, const char *path)
{
    const size_t length = strlen(path);
    const bool begins = !strncmp(why, path, length) && !strncmp(why + length, ": ", 2);
    return begins ? why + length + 2 : why;
}

/* Marks the rows that would measure nothing here, and keeps the reason. */
static int leave_out_idle(sweep *s)
{
    triptych *t;
    int status = accuracy_contexts_open(&s->contexts, 0, TRIPTYCH_RENDERER_CPU, &t);
    triptych_info info;
    if (status == TRIP_ERROR)
        return trip_fail(TRIP_ERROR, "accuracy", s->o->data[0], "%s",
                         without_path(s->contexts.why[0][TRIPTYCH_RENDERER_CPU], s->o->data[0]));
    if (status || triptych_get_info(t, &info))
        return status ? status : TRIP_ERROR;
    s->m->checksum = info.checksum;
    note_levels(s->m, info.notes);
    for (int i = 0; i < s->m->row_count; i++) {
        accuracy_row *row = &s->m->rows[i];
        const int64_t *n = info.dims;
        if (row->is_vtk && (double)n[0] * (double)n[1] * (double)n[2] * ACCURACY_VTK_VOXEL_BYTES >
                               0.25 * (double)trip_memory_available_bytes())
            leave_out(row, "VTK would hold the whole volume in memory; give --compare to measure "
                           "it nevertheless");
        if (row->program)
            continue;
        if (row->setting.settings.lod.voxel_px > 0 && !has_levels(t, &row->setting.settings))
            leave_out(row, "the data set has no coarse levels for this setting");
    }
    return 0;
}

/* ---- pictures of the steps ---- */

/* Draws the integral along rays x rays rays per pixel, or its mean over the area if `rays` is 0. */
static int draw_integral(sweep *s, int data, int renderer, draw_settings settings, int rays,
                         float *rgba)
{
    double ms;
    settings.integral.tolerance =
        rays ? fmin(s->o->tolerance, ACCURACY_RAY_TOLERANCE) : s->o->tolerance;
    settings.all.samples = rays;
    measure_progress_part(s->progress, "integral");
    int status = accuracy_contexts_draw(&s->contexts, data, renderer, &settings, rgba, &ms);
    return status == TRIP_ERROR
               ? trip_fail(TRIP_ERROR, "accuracy",
                           renderer == ACCURACY_SOURCE ? s->o->source : s->o->data[data],
                           "the integral failed: %s", s->contexts.why[data][renderer])
               : status;
}

/* Returns the settings for the integral of values with the default interpolation. */
static draw_settings default_field(const sweep *s)
{
    draw_settings settings = s->defaults;
    settings.integral.field = TRIPTYCH_FIELD_VALUES;
    return settings;
}

/* Draws the integral of the source if it is given, else of the data set. */
static int draw_truth(sweep *s, int rays, which picture)
{
    return draw_integral(s, 0, s->o->source ? ACCURACY_SOURCE : TRIPTYCH_RENDERER_INTEGRAL,
                         default_field(s), rays, s->pictures[picture]);
}

/* Returns the rays along each side of a pixel, or 0 if the program chooses them itself. Other
 * programs are taken to draw one ray per pixel. */
static int rays_of(const accuracy_row *row)
{
    return row->program ? 1 : row->setting.settings.all.samples;
}

static int need_along(sweep *s, const accuracy_row *row)
{
    const int rays = rays_of(row);
    if (s->along_rays == rays)
        return 0;
    s->along_rays = rays;
    return draw_truth(s, rays, ALONG);
}

static int need_stored(sweep *s, const accuracy_row *row)
{
    const int rays = rays_of(row);
    if (s->stored_data == row->data && s->stored_rays == rays)
        return 0;
    s->stored_data = row->data;
    s->stored_rays = rays;
    if (row->data == 0 && !s->o->source && s->along_rays == rays) {
        memcpy(s->pictures[STORED], s->pictures[ALONG], s->picture_bytes);
        return 0;
    }
    return draw_integral(s, row->data, TRIPTYCH_RENDERER_INTEGRAL, default_field(s), rays,
                         s->pictures[STORED]);
}

/* Draws the integral of the field that a row draws: the sum of its splats, or values by its
 * kernel. */
static int need_field(sweep *s, const accuracy_row *row, bool splats)
{
    const draw_settings *drawn = &row->setting.settings;
    draw_settings field = default_field(s);
    field.all.samples = rays_of(row);
    if (splats) {
        field.integral.field = TRIPTYCH_FIELD_SPLATS;
        field.splat.kernel_radius = drawn->splat.kernel_radius;
    } else {
        field.all.interpolation = drawn->all.interpolation;
    }
    if (s->field_data == row->data && draw_settings_same(&s->field, &field))
        return 0;
    s->field_data = row->data;
    s->field = field;
    return draw_integral(s, row->data, TRIPTYCH_RENDERER_INTEGRAL, field, rays_of(row),
                         s->pictures[FIELD]);
}

/* Draws the reference with a row's settings, and at the finest level if the row draws coarse
 * ones. */
static int need_reference(sweep *s, const accuracy_row *row)
{
    draw_settings settings = row->setting.settings;
    double ms;
    if (s->reference_data == row->data && accuracy_setting_same_reference(&settings, &s->reference))
        return 0;
    s->reference_data = -1;
    s->reference = settings;
    draw_settings_drop_excluded(&settings, TRIPTYCH_RENDERER_REFERENCE);
    measure_progress_part(s->progress, "reference");
    int status = accuracy_contexts_draw(&s->contexts, row->data, TRIPTYCH_RENDERER_REFERENCE,
                                        &settings, s->pictures[REFERENCE], &ms);
    memcpy(s->pictures[FINE], s->pictures[REFERENCE], s->picture_bytes);
    settings.lod.voxel_px = TRIPTYCH_ZERO;
    if (!status && row->setting.settings.lod.voxel_px > 0)
        status = accuracy_contexts_draw(&s->contexts, row->data, TRIPTYCH_RENDERER_REFERENCE,
                                        &settings, s->pictures[FINE], &ms);
    s->reference_data = status ? -1 : row->data;
    return status;
}

static void compare(sweep *s, accuracy_row *row, accuracy_step step, which a, which b)
{
    row->has[step] = true;
    measure_error_add(&row->error[step], s->pictures[a], s->pictures[b], pixels_of(s));
}

/* Returns whether the frame was drawn by pre-classification. */
static bool is_pre(const triptych_frame_stats *stats)
{
    return stats->classify == TRIPTYCH_CLASSIFY_PRE;
}

/* Compares with the integral along the rays of a row. Without --steps, only rows with one ray per
 * pixel are compared, since they share one picture, and more rays take long. */
static int compare_along(sweep *s, accuracy_row *row)
{
    const int rays = rays_of(row);
    if (!rays || (rays > 1 && !s->o->steps))
        return 0;
    const int status = need_along(s, row);
    if (!status) {
        compare(s, row, ACCURACY_PIXEL, ALONG, TRUTH);
        compare(s, row, ACCURACY_RAYS, RAN, ALONG);
    }
    return status;
}

static int climb(sweep *s, accuracy_row *row, const triptych_frame_stats *stats)
{
    if (!s->o->steps || !rays_of(row))
        return 0;
    int status = need_stored(s, row);
    if (status)
        return status;
    if (s->o->source)
        compare(s, row, ACCURACY_STORAGE, STORED, ALONG);
    /* The integral has no Gaussian interpolation. The smoothing by that kernel counts as a
     * method error. */
    const triptych_interpolation interpolation = row->setting.settings.all.interpolation;
    const bool pre = is_pre(stats), own = interpolation != TRIPTYCH_INTERPOLATION_DEFAULT &&
                                          interpolation != TRIPTYCH_INTERPOLATION_GAUSSIAN;
    which drawn = pre || own ? FIELD : STORED;
    if (drawn == FIELD)
        status = need_field(s, row, pre);
    if (status)
        return status;
    compare(s, row, ACCURACY_MODEL, drawn, STORED);
    status = need_reference(s, row);
    if (status) /* the reference renderer lacks some settings */
        return status == TRIP_ERROR ? 0 : status;
    compare(s, row, ACCURACY_METHOD, FINE, drawn);
    if (row->setting.settings.lod.voxel_px > 0)
        compare(s, row, ACCURACY_LEVEL, REFERENCE, FINE);
    compare(s, row, ACCURACY_PRECISION, RAN, REFERENCE);
    return 0;
}

/* ---- measuring a row ---- */

static int keep_exr(sweep *s, triptych *t, which picture, int view, const char *name)
{
    char path[4096];
    if (!s->o->pictures)
        return 0;
    if (snprintf(path, sizeof path, "%s/%s-%d.exr", s->m->folder, name, view) >= (int)sizeof path)
        return trip_fail(TRIP_USAGE, "accuracy", s->m->folder, "the name is too long");
    if (triptych_write(t, path, s->o->width, s->o->height, s->pictures[picture]) == 0)
        return 0;
    trip_report_line(triptych_error(t));
    return TRIP_ERROR;
}

static int compare_with_truth(sweep *s, accuracy_row *row)
{
    double ssim, flip;
    const float *ran = s->pictures[RAN], *truth = s->pictures[TRUTH];
    compare(s, row, ACCURACY_TOTAL, RAN, TRUTH);
    row->bound =
        fmax(row->bound, measure_error_bound(&s->view, ran, truth, pixels_of(s), PROMISED_SHARE));
    int status = accuracy_ssim(ran, truth, s->o->width, s->o->height, s->contexts.budget, &ssim);
    if (!status)
        status = accuracy_flip(ran, truth, s->o->width, s->o->height, s->contexts.budget, &flip);
    if (status)
        return status;
    row->ssim += ssim;
    row->flip += flip;
    if (row->views == 0) {
        row->picture = accuracy_picture_data(ran, s->o->width, s->o->height, THUMBNAIL_PX);
        row->difference =
            accuracy_difference_data(ran, truth, s->o->width, s->o->height, THUMBNAIL_PX);
    }
    return 0;
}

/* Counts splats in a frame of its own, so that counting changes no timing. */
static int count_splats(sweep *s, accuracy_row *row, float *rgba)
{
    draw_settings settings = row->setting.settings;
    triptych *t = s->contexts.contexts[row->data][row->setting.renderer];
    triptych_info info;
    triptych_list_stats list;
    double ms;
    settings.all.count_exactly = 1;
    int status = accuracy_contexts_draw(&s->contexts, row->data, row->setting.renderer, &settings,
                                        rgba, &ms);
    if (status == TRIP_ERROR)
        return 0;
    if (!status && triptych_get_info(t, &info) == 0) {
        row->splats_drawn = 0;
        for (unsigned i = 0; i < info.lists; i++)
            if (triptych_get_list_stats(t, i, &list) == 0)
                row->splats_drawn += (double)list.splats_drawn;
    }
    return status;
}

static int time_row(sweep *s, accuracy_row *row)
{
    int status = 0;
    for (int i = 0; i < s->o->repeat && !status; i++)
        status = accuracy_contexts_draw(&s->contexts, row->data, row->setting.renderer,
                                        &row->setting.settings, s->pictures[RAN],
                                        &row->ms[row->frames++]);
    return status;
}

static int draw_program(sweep *s, accuracy_row *row, int view)
{
    accuracy_program *b = row->program;
    const accuracy_view *seen = &s->m->views[view];
    double ms;
    int status = accuracy_program_picture(b, seen, s->m->folder, s->pictures[RAN], &ms, row->why);
    for (int i = 0; i < s->o->repeat && !status; i++)
        status = accuracy_program_draw(b, seen, &row->ms[row->frames++], row->why);
    return status;
}

/* Measures another program in a view, like measure_row() for settings. */
static int measure_program(sweep *s, accuracy_row *row, int view)
{
    triptych *t = s->contexts.contexts[0][TRIPTYCH_RENDERER_CPU];
    int status = 0;
    measure_progress_step(s->progress, row->setting.name);
    if (view == 0) {
        status = accuracy_program_start(row->program, s->o, t, row->why);
        if (!status)
            snprintf(row->setting.name, sizeof row->setting.name, "%.*s",
                     (int)sizeof row->setting.name - 1, row->program->name);
    }
    if (!status)
        status = draw_program(s, row, view);
    if (status == TRIP_ERROR) {
        row->state = ACCURACY_LEFT_OUT;
        drop_steps(s, view);
        return 0;
    }
    if (!status)
        status = compare_with_truth(s, row);
    if (!status)
        status = compare_along(s, row);
    if (!status)
        status = keep_exr(s, t, RAN, view, row->setting.name);
    row->views++;
    row->state = ACCURACY_MEASURED;
    return status;
}

/* Measures a setting in a view. The first frame is not timed; it also fills the caches. */
static int measure_row(sweep *s, accuracy_row *row, int view)
{
    int renderer = (int)row->setting.renderer;
    triptych_frame_stats stats;
    double ms;
    measure_progress_step(s->progress, row->setting.name);
    int status = accuracy_contexts_draw(&s->contexts, row->data, renderer, &row->setting.settings,
                                        s->pictures[RAN], &ms);
    if (status == TRIP_ERROR) {
        leave_out(row, "%s", s->contexts.why[row->data][renderer]);
        drop_steps(s, view);
        return 0;
    }
    triptych *t = s->contexts.contexts[row->data][renderer];
    if (status || triptych_get_frame_stats(t, &stats))
        return status ? status : TRIP_ERROR;
    row->splats += (double)stats.splats;
    row->bytes_read += (double)stats.bytes_read;
    status = compare_with_truth(s, row);
    if (!status)
        status = keep_exr(s, t, RAN, view, row->setting.name);
    if (!status)
        status = compare_along(s, row);
    if (!status)
        status = climb(s, row, &stats);
    if (!status)
        status = time_row(s, row);
    if (!status && view == 0 && is_pre(&stats) && renderer != TRIPTYCH_RENDERER_INTEGRAL)
        status = count_splats(s, row, s->pictures[RAN]);
    row->views++;
    row->state = ACCURACY_MEASURED;
    return status;
}

/* ---- views ---- */

/* Returns the share of the pixels that the object covers. */
static double covered_share(const sweep *s)
{
    size_t covered = 0;
    for (size_t i = 0; i < pixels_of(s); i++)
        covered += s->pictures[TRUTH][4 * i + 3] > 1.0F / 255;
    return (double)covered / (double)pixels_of(s);
}

/* Draws the truth of a view. */
static int find_truth(sweep *s, int view)
{
    const double begin = trip_now_seconds();
    s->stored_data = s->field_data = s->reference_data = -1;
    s->along_rays = 0;
    int status = draw_truth(s, 0, TRUTH);
    if (status)
        return status;
    s->truth_seconds = trip_now_seconds() - begin;
    s->truth_covered = covered_share(s);
    if (view == 0)
        s->m->truth =
            accuracy_picture_data(s->pictures[TRUTH], s->o->width, s->o->height, THUMBNAIL_PX);
    triptych *t = s->contexts.contexts[0][TRIPTYCH_RENDERER_CPU];
    return keep_exr(s, t, TRUTH, view, "truth");
}

static int set_view(sweep *s, int view)
{
    accuracy_measured *m = s->m;
    triptych *t = s->contexts.contexts[0][TRIPTYCH_RENDERER_CPU];
    int status =
        accuracy_view_find(t, s->o->width, s->o->height, view, s->o->views, &m->views[view]);
    if (!status)
        status = accuracy_contexts_look(&s->contexts, &m->views[view]);
    return status ? trip_fail(TRIP_ERROR, "accuracy", s->o->data[0], "cannot set a view: %s",
                              triptych_error(t))
                  : 0;
}

/* In the first view, a row starts only while the time budget lasts. Later views measure all rows
 * that the first view measured. */
static int measure_rows(sweep *s, int view)
{
    accuracy_measured *m = s->m;
    int status = 0;
    for (int i = 0; i < m->row_count && !status; i++) {
        accuracy_row *row = &m->rows[i];
        if (row->state != (view ? ACCURACY_MEASURED : ACCURACY_NOT_REACHED))
            continue;
        if (view == 0 && i > 0 && is_over(s)) {
            measure_progress_expect(s->progress, -1);
            drop_steps(s, view);
        } else
            status = row->program ? measure_program(s, row, view) : measure_row(s, row, view);
    }
    return status;
}

/* The first view is set, and its integral drawn. */
static int measure_view(sweep *s, int view)
{
    int status = 0;
    measure_progress_step(s->progress, "integral");
    if (view > 0)
        status = set_view(s, view);
    if (!status && view > 0)
        status = find_truth(s, view);
    if (!status)
        status = measure_rows(s, view);
    if (!status)
        s->m->view_count++;
    return status;
}

/* Starts a view only if the budget allows the mean time of the views before it. */
static bool has_time_for(const sweep *s, int view)
{
    double spent = trip_now_seconds() - s->begin;
    return view == 0 || spent * (view + 1) / view <= s->o->budget_seconds;
}

static int take_pictures(sweep *s)
{
    s->picture_bytes = 4 * pixels_of(s) * sizeof(float);
    for (int i = 0; i < PICTURES; i++)
        if (!(s->pictures[i] = trip_budget_take(s->contexts.budget, s->picture_bytes)))
            return trip_fail(
                TRIP_ERROR, "accuracy", s->o->data[0],
                "pictures of %d x %d pixels do not fit the memory; raise --memory or reduce --size",
                s->o->width, s->o->height);
    return 0;
}

static draw_settings default_settings(const accuracy_options *o)
{
    /* transparent */
    return (draw_settings){ .light.no_shading = !o->shading, .has_background = 1 };
}

/* Measures popping while the time budget lasts. The remaining steps of a table that fails do not
 * begin. */
static int measure_popping(sweep *s)
{
    int status = 0;
    for (int i = 0; i < s->m->popping_count && !status; i++) {
        int begun = 0;
        if (!is_over(s))
            status = accuracy_popping_measure(&s->m->popping[i], &s->contexts, &s->defaults,
                                              s->progress, s->pictures[RAN], &begun);
        measure_progress_expect(s->progress, begun - ACCURACY_POPPING_ROWS);
    }
    return status;
}

/* ---- the start ---- */

/* Draws a frame and adds its seconds to *sum. Failures count as no time. */
static int try_frame(sweep *s, int data, int renderer, draw_settings settings, double *sum)
{
    double ms = 0;
    draw_settings_drop_excluded(&settings, (triptych_renderer)renderer);
    const int status =
        accuracy_contexts_draw(&s->contexts, data, renderer, &settings, s->pictures[RAN], &ms);
    *sum += status ? 0 : ms / 1e3;
    return status == TRIP_ERROR ? 0 : status;
}

/* Leaves out gl from the usual settings if `render` does not choose it here. */
static int choose_gl(sweep *s)
{
    triptych_frame_stats stats;
    double seconds = 0;
    if (!s->o->usual)
        return 0;
    int status = try_frame(s, 0, TRIPTYCH_RENDERER_AUTO, s->defaults, &seconds);
    triptych **t = &s->contexts.contexts[0][TRIPTYCH_RENDERER_AUTO];
    const bool gl =
        *t && triptych_get_frame_stats(*t, &stats) == 0 && !strcmp(stats.renderer, "gl");
    triptych_destroy(*t);
    *t = NULL;
    for (int i = 0; i < s->m->row_count && !gl; i++)
        if (s->m->rows[i].setting.renderer == TRIPTYCH_RENDERER_GL)
            leave_out(&s->m->rows[i], "no graphics device; --settings 'gl-*' measures gl "
                                      "on the processor");
    return status;
}

/* Draws one frame of each row, and with --steps one reference for each classification. Sets *frames
 * and *steps to the seconds of such frames in one view. */
static int try_rows(sweep *s, double *frames, double *steps)
{
    double references[2] = { 0 };
    int status = 0;
    for (int i = 0; i < s->m->row_count && !status && !(i > 0 && is_over(s)); i++) {
        const accuracy_row *row = &s->m->rows[i];
        const draw_settings *own = &row->setting.settings;
        double *reference = &references[own->all.classify == TRIPTYCH_CLASSIFY_PRE];
        if (row->state != ACCURACY_NOT_REACHED || row->program)
            continue;
        status = try_frame(s, row->data, (int)row->setting.renderer, *own, frames);
        if (!status && s->o->steps && rays_of(row) && *reference <= 0)
            status = try_frame(s, row->data, TRIPTYCH_RENDERER_REFERENCE, *own, reference);
        *steps += *reference * rays_of(row) * rays_of(row);
    }
    return status;
}

static int try_comparison(sweep *s)
{
    accuracy_row trial = { .views = 1 }; /* without pictures for the page */
    const double begin = trip_now_seconds();
    int status = compare_with_truth(s, &trial);
    s->compare_seconds = trip_now_seconds() - begin;
    return status;
}

/* Draws the integral along one ray per pixel if a row needs it. Sets *seconds to the time of all
 * integrals along rays in one view. */
static int try_rays(sweep *s, double *seconds)
{
    bool seen[ACCURACY_RAYS_MAX + 1] = { true };
    const accuracy_row one = { .setting.settings.all.samples = 1 };
    const double begin = trip_now_seconds();
    int rays2 = 0, status = 0;
    for (int i = 0; i < s->m->row_count; i++) {
        const int rays = rays_of(&s->m->rows[i]);
        if (s->m->rows[i].state != ACCURACY_NOT_REACHED || seen[rays] || (rays > 1 && !s->o->steps))
            continue;
        seen[rays] = true;
        rays2 += rays * rays;
    }
    if (rays2)
        status = need_along(s, &one);
    *seconds = (trip_now_seconds() - begin) * rays2 * (s->o->steps && s->o->source ? 2 : 1);
    return status;
}

/* Returns the time of the integrals in all views, relative to the first view. The object covers
 * the whole picture in views from inside and from nearby. */
static double views_of_integral(const sweep *s)
{
    double views = 0;
    for (int i = 0; i < s->o->views; i++)
        views += i % 4 < 2 || !(s->truth_covered > 0) ? 1 : 1 / s->truth_covered;
    return views;
}

/* Estimates the seconds that all views and tables take, without other programs. */
static int estimate(sweep *s, double *seconds)
{
    double frames = 0, steps = 0, turn = 0, rays = 0;
    int status = try_rows(s, &frames, &steps);
    if (!status)
        status = try_rays(s, &rays);
    if (!status)
        status = try_comparison(s);
    for (int i = 0; i < s->m->popping_count && !status; i++) {
        draw_settings settings = s->defaults;
        settings.all.classify = s->m->popping[i].classify;
        status = try_frame(s, 0, TRIPTYCH_RENDERER_CPU, settings, &turn);
    }
    *seconds =
        views_of_integral(s) * (s->truth_seconds + rays) - s->truth_seconds +
        s->o->views * (steps + (1 + s->o->repeat) * frames + s->rows_left * s->compare_seconds) +
        turn * ACCURACY_POPPING_ROWS * (MEASURE_POPPING_STEPS + 1);
    return status;
}

static void write_time(double seconds, char text[32])
{
    if (seconds < 90)
        snprintf(text, 32, "about %.0f seconds", fmax(1, seconds));
    else
        snprintf(text, 32, "about %.0f minutes", ceil(seconds / 60));
}

/* Prints the numbers of settings and views, the time needed, and the usual omissions. */
static void say_start(const sweep *s, double seconds)
{
    const accuracy_measured *m = s->m;
    char time[32];
    accuracy_setting all[ACCURACY_SETTINGS_MAX];
    const draw_settings defaults = { 0 };
    const int others = accuracy_settings(all, &defaults) - m->row_count;
    write_time(seconds, time);
    trip_note("accuracy", "%d settings in %d views take %s%s%s", s->rows_left, s->o->views, time,
              seconds > 90 ? "; --budget, --views or --settings shorten it" : "",
              m->row_count && m->rows[m->row_count - 1].program
                  ? ", and as long as the other programs take"
                  : "");
    if (s->o->usual)
        trip_note("accuracy",
                  "left out: %d other settings, which --settings all measures; the steps of each "
                  "error, which --steps measures",
                  others);
}

/* Draws the integral of the first view, tries one frame of each row, and says how long the
 * measurement takes. */
static int begin_views(sweep *s)
{
    double seconds = 0;
    int status = set_view(s, 0);
    if (!status)
        status = find_truth(s, 0);
    if (!status)
        status = choose_gl(s);
    for (int i = 0; i < s->m->row_count; i++)
        s->rows_left += s->m->rows[i].state == ACCURACY_NOT_REACHED;
    if (status || command_line_quiet())
        return status;
    status = estimate(s, &seconds);
    if (!status)
        say_start(s, seconds);
    return status;
}

static int measure_views(sweep *s)
{
    int status = begin_views(s);
    if (!status && !command_line_quiet())
        s->progress = measure_progress_start_lines("accuracy");
    measure_progress_expect(s->progress, s->o->views * (1 + s->rows_left) +
                                             ACCURACY_POPPING_ROWS * s->m->popping_count);
    int view = 0;
    for (; view < s->o->views && !status && has_time_for(s, view); view++)
        status = measure_view(s, view);
    measure_progress_expect(s->progress, -(s->o->views - view) * (1 + s->rows_left));
    return status ? status : measure_popping(s);
}

int accuracy_measure(accuracy_measured *m, const accuracy_options *o, const char *folder)
{
    sweep *s = calloc(1, sizeof *s);
    *m = (accuracy_measured){ .options = o, .folder = folder };
    if (!s)
        return trip_fail(TRIP_ERROR, "accuracy", "sweep", "out of memory");
    s->m = m;
    s->o = o;
    s->defaults = default_settings(o);
    s->begin = trip_now_seconds();
    int status = add_rows(m, &s->defaults);
    if (!status)
        status = accuracy_contexts_create(&s->contexts, o);
    if (!status)
        status = take_pictures(s);
    if (!status)
        status = leave_out_idle(s);
    if (!status)
        status = measure_views(s);
    m->seconds = trip_now_seconds() - s->begin;
    measure_progress_end(s->progress);
    for (int i = 0; i < PICTURES; i++)
        if (s->pictures[i])
            trip_budget_release(s->contexts.budget, s->pictures[i], s->picture_bytes);
    accuracy_contexts_close(&s->contexts);
    free(s);
    return status;
}

void accuracy_measured_free(accuracy_measured *m)
{
    for (int i = 0; i < m->row_count; i++) {
        if (m->rows[i].program)
            accuracy_program_end(m->rows[i].program);
        free(m->rows[i].program);
        free(m->rows[i].ms);
        free(m->rows[i].picture);
        free(m->rows[i].difference);
    }
    free(m->rows);
    free(m->views);
    free(m->truth);
    *m = (accuracy_measured){ 0 };
}
