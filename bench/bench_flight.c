/* bench flight: measures the viewer's drawing thread while the eye turns around a data set,
 * approaches it and flies through it. The table gives the times between pictures. Checks that the
 * picture at rest equals the library's picture. */
#include "bench_tables.h"

#include <math.h>
#include <stdlib.h>

#include "bench_context.h"
#include "budget.h"
#include "flyer.h"
#include "report.h"
#include "median.h"

typedef struct flying {
    const bench_options *options;
    bench_report *report;
    flyer flyer;
    trip_frames_status status; /* at rest */
} flying;

/* ---- frame times ---- */

/* Returns the smallest of the sorted numbers that is not less than a given part of them. */
static double quantile(const double *sorted, int count, double part)
{
    const int i = (int)ceil(part * count) - 1;
    return count ? sorted[i < 0 ? 0 : i] : 0;
}

/* The pictures of a part of the flight. */
typedef struct part {
    double *between, *age, *scale; /* of each picture */
    int count, stale;
} part;

/* Collects the pictures of input steps `first` to before `past`. */
static void gather(const flyer *f, int first, int past, part *p)
{
    for (int i = 1; i < f->picture_count; i++) {
        const flyer_picture *at = &f->pictures[i];
        if (at->step < first || at->step >= past)
            continue;
        p->between[p->count] = at->ms - at[-1].ms;
        p->age[p->count] = at->age_ms;
        p->scale[p->count] = at->scale;
        p->stale += at->step < at->latest - 1;
        p->count++;
    }
    measure_sort(p->between, p->count);
    measure_sort(p->age, p->count);
    measure_sort(p->scale, p->count);
}

static void add_part(cJSON *table, const char *name, const part *p)
{
    double sum = 0;
    cJSON *row = measure_new_row(table);
    for (int i = 0; i < p->count; i++)
        sum += p->between[i];
    cJSON_AddStringToObject(row, "part", name);
    measure_add(row, { "pictures", p->count }, { "fps", sum > 0 ? 1e3 * p->count / sum : 0 },
                { "ms", quantile(p->between, p->count, 0.5) },
                { "ms_99", quantile(p->between, p->count, 0.99) },
                { "ms_max", quantile(p->between, p->count, 1) },
                { "age_ms", quantile(p->age, p->count, 0.5) },
                { "age_ms_99", quantile(p->age, p->count, 0.99) }, { "stale", p->stale },
                { "scale", quantile(p->scale, p->count, 0.5) });
}

static const measure_column part_columns[] = {
    { "part", "part", 0, 0 },
    { "pictures", "pictures", 0, 0 },
    { "fps", "pictures/s", 1, 0 },
    { "ms", "ms between: median", 1, 0 },
    { "ms_99", "99 %", 1, 0 },
    { "ms_max", "max", 1, 0 },
    { "age_ms", "ms from input: median", 1, 0 },
    { "age_ms_99", "99 %", 1, 0 },
    { "stale", "outdated", 0, 0 },
    { "scale", "scale", 2, 0 },
};

static int add_parts(const flying *m)
{
    static const char *const names[FLYER_PARTS] = { "round", "nearer", "through", "back" };
    const flyer *f = &m->flyer;
    cJSON *table =
        bench_report_table(m->report, "parts", "Pictures while the eye moves", part_columns);
    const size_t room = (size_t)f->picture_count + 1;
    double *memory = calloc(3 * room, sizeof *memory);
    if (!memory)
        return trip_fail(TRIP_ERROR, "bench", "flight", "out of memory");
    for (int i = 0; i <= FLYER_PARTS; i++) {
        part p = { memory, memory + room, memory + 2 * room, 0, 0 };
        const int steps = f->steps / FLYER_PARTS;
        if (i < FLYER_PARTS)
            gather(f, i * steps, (i + 1) * steps, &p);
        else
            gather(f, 0, f->steps, &p);
        add_part(table, i < FLYER_PARTS ? names[i] : "all", &p);
    }
    free(memory);
    return 0;
}

/* ---- at rest ---- */

static int byte_of(float x)
{
    return x > 0 ? (x < 1 ? (int)(x * 255 + 0.5f) : 255) : 0;
}

/* Counts the channels that differ between the picture at rest and the library's picture. */
static int compare_rest(const flying *m, int *differ)
{
    const int width = m->options->sizes[0][0], height = m->options->sizes[0][1];
    const triptych_view view = trip_navigation_view(&m->flyer.wanted.navigation, width, height);
    triptych_camera camera;
    bench_context c;
    float *rgba = NULL;
    *differ = 0;
    int status = bench_context_open(&c, m->options->input, m->options);
    c.settings = (draw_settings){ .has_background = 0 };
    if (!status)
        status = bench_context_find(&c, &view, &camera);
    if (!status)
        status = bench_context_picture(&c, width, height, &rgba);
    if (!status)
        status =
            bench_context_draw(&c, c.settings.lod.voxel_px, c.settings.all.samples, rgba, NULL);
    for (size_t i = 0; !status && i < (size_t)width * (size_t)height; i++)
        for (size_t k = 0; k < 3; k++)
            *differ += byte_of(rgba[4 * i + k]) != m->flyer.last[4 * i + k];
    bench_context_close(&c);
    return status;
}

static const measure_column rest_columns[] = {
    { "first_ms", "ms to first picture", 0, 0 }, { "first_whole_ms", "to complete picture", 0, 0 },
    { "rest_ms", "after flight", 0, 0 },         { "differ", "differing channels", 0, 0 },
    { "peak_bytes", "peak memory MB", 1, 1e6 },  { "limit_bytes", "limit MB", 1, 1e6 },
    { "resident_bytes", "resident MB", 1, 1e6 },
};

static int add_rest(const flying *m)
{
    cJSON *table =
        bench_report_table(m->report, "rest", "Before and after the flight", rest_columns);
    cJSON *row = measure_new_row(table);
    const double resident = (double)trip_memory_peak_rss_bytes();
    int differ;
    measure_add(row, { "first_ms", m->flyer.first_ms },
                { "first_whole_ms", m->flyer.first_whole_ms }, { "rest_ms", m->flyer.rest_ms },
                { "peak_bytes", (double)m->status.stats.peak_memory_bytes },
                { "limit_bytes", (double)m->status.stats.memory_bytes },
                { "resident_bytes", resident });
    int status = compare_rest(m, &differ);
    cJSON_AddNumberToObject(row, "differ", differ);
    return status;
}

static void describe(const flying *m)
{
    const bench_options *o = m->options;
    const triptych_info *info = &m->flyer.opened.info;
    cJSON *settings = m->report->settings;
    char text[64];
    cJSON_AddStringToObject(settings, "data_set", o->input);
    const triptych_scene *scene = &m->flyer.opened.scene;
    if (m->flyer.opened.is_scene) {
        cJSON_AddNumberToObject(settings, "gaussians", (double)scene->gaussians);
        cJSON_AddNumberToObject(settings, "stored_bytes", (double)scene->bytes);
    } else {
        snprintf(text, sizeof text, "%lld x %lld x %lld", (long long)info->dims[0],
                 (long long)info->dims[1], (long long)info->dims[2]);
        cJSON_AddStringToObject(settings, "grid", text);
        cJSON_AddNumberToObject(settings, "stored_bytes", (double)info->bytes);
        cJSON_AddStringToObject(settings, "transfer_function",
                                o->tf ? o->tf : "stored in the data set");
    }
    bench_report_add_size(settings, o->sizes[0]);
    cJSON_AddStringToObject(settings, "options_of_render", "none: the viewer draws its default");
    cJSON_AddStringToObject(settings, "renderer", m->status.renderer);
    cJSON_AddStringToObject(settings, "device", m->status.device);
    cJSON_AddNumberToObject(settings, "wanted_fps", o->frames_per_second);
}

static void add_limits(const flying *m)
{
    bench_report_limit(
        m->report,
        "Input comes in %d steps, %d per second, independent of drawing. ms from input: from a "
        "step to its picture. outdated: pictures that are more than one step older than the newest "
        "input at the time of the previous picture. scale: median of drawn width / full width.",
        m->flyer.steps, FLYER_STEPS_PER_SECOND);
    bench_report_limit(m->report,
                       "Resident memory includes the program and its libraries. The data set may "
                       "be in the page cache; empty the cache to include the disk.");
}

static int fly(flying *m)
{
    const bench_options *o = m->options;
    const trip_frames_params params = { .memory_bytes = o->memory_bytes,
                                        .threads = (unsigned)o->threads[0],
                                        .renderer = bench_context_renderer(o),
                                        .engine = (triptych_engine)o->engine,
                                        .frames_per_second = o->frames_per_second };
    const trip_wanted wanted = { .document = 1,
                                 .input = o->input,
                                 .width = o->sizes[0][0],
                                 .height = o->sizes[0][1],
                                 .function = o->tf,
                                 .opacity_scale = 1 };
    int status = flyer_fly(&m->flyer, &params, &wanted, o->seconds);
    if (m->flyer.frames)
        m->status = trip_frames_get_status(m->flyer.frames);
    flyer_land(&m->flyer);
    return status;
}

int bench_flight(const session *s, const bench_options *o, bench_report *r)
{
    flying m = { .options = o, .report = r };
    (void)s;
    measure_progress_expect(o->progress, 1); /* the picture of the library at rest */
    int status = fly(&m);
    if (!status) {
        describe(&m);
        status = add_parts(&m);
    }
    if (!status)
        status = add_rest(&m);
    if (!status)
        add_limits(&m);
    flyer_release(&m.flyer);
    return status;
}
