#include "setting.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "report.h"

typedef struct sweep {
    accuracy_setting *out;
    int count;
    draw_settings pre, post;
} sweep;

__attribute__((format(printf, 4, 5))) static void add(sweep *w, triptych_renderer renderer,
                                                      draw_settings s, const char *name, ...)
{
    va_list arguments;
    accuracy_setting *one = &w->out[w->count++];
    va_start(arguments, name);
    vsnprintf(one->name, sizeof one->name, name, arguments);
    va_end(arguments);
    one->renderer = renderer;
    one->settings = s;
}


static void add_qualities(sweep *w, const draw_settings *defaults)
{
    for (int q = TRIPTYCH_QUALITY_DRAFT; q <= TRIPTYCH_QUALITY_EXACT; q++) {
        draw_settings s = *defaults;
        s.all.quality = (triptych_quality)q;
        add(w, TRIPTYCH_RENDERER_CPU, s, "quality-%s", draw_settings_choice(&s, DRAW_QUALITY));
    }
}

/* Adds post with each number of samples per sheet, the parameter h of the papers, and the other
 * methods. */
static void add_post(sweep *w)
{
    static const int samples_per_sheet[] = { 1, 2, 3, 4, 6, 8, 16 };
    static const double h[] = { 0, 0.5, 0.7, 0.85, 0.95 };
    draw_settings s = w->post;
    add(w, TRIPTYCH_RENDERER_CPU, s, "post");
    for (size_t i = 0; i < sizeof samples_per_sheet / sizeof *samples_per_sheet; i++) {
        s.sheet.samples = samples_per_sheet[i];
        add(w, TRIPTYCH_RENDERER_CPU, s, "post-samples-per-sheet-%d", samples_per_sheet[i]);
    }
    s = w->post;
    s.all.method = TRIPTYCH_METHOD_CLIP;
    add(w, TRIPTYCH_RENDERER_CPU, s, "post-clip");
    s.sheet.samples = 1;
    add(w, TRIPTYCH_RENDERER_CPU, s, "post-clip-samples-per-sheet-1");
    s = w->post;
    s.all.method = TRIPTYCH_METHOD_AXIS;
    add(w, TRIPTYCH_RENDERER_CPU, s, "post-axis");
    s = w->post;
    for (size_t i = 0; i < sizeof h / sizeof *h; i++) {
        s.all.h = h[i] > 0 ? h[i] : TRIPTYCH_ZERO;
        add(w, TRIPTYCH_RENDERER_CPU, s, "post-h-%g", h[i]);
    }
}

static void add_pre(sweep *w, triptych_compositing compositing)
{
    static const double h[] = { 0, 0.5, 0.95, 0.99 };
    const char *name = compositing == TRIPTYCH_COMPOSITING_SHEET ? "pre-sheet" : "pre";
    draw_settings s = w->pre;
    s.splat.compositing = compositing;
    add(w, TRIPTYCH_RENDERER_CPU, s, "%s", name);
    for (size_t i = 0; i < sizeof h / sizeof *h; i++) {
        s.all.h = h[i] > 0 ? h[i] : TRIPTYCH_ZERO;
        add(w, TRIPTYCH_RENDERER_CPU, s, "%s-h-%g", name, h[i]);
    }
    s.all.h = 0;
    s.all.method = TRIPTYCH_METHOD_CLIP;
    add(w, TRIPTYCH_RENDERER_CPU, s, "%s-clip", name);
    s.all.method = TRIPTYCH_METHOD_AXIS;
    add(w, TRIPTYCH_RENDERER_CPU, s, "%s-axis", name);
}

static void add_targets(sweep *w)
{
    for (int sheets = 0; sheets < 2; sheets++) {
        draw_settings s = w->pre;
        const char *name = sheets ? "pre-sheet" : "pre";
        s.splat.compositing = sheets ? TRIPTYCH_COMPOSITING_SHEET : TRIPTYCH_COMPOSITING_SPLAT;
        s.splat.target = TRIPTYCH_TARGET_RGBA16F;
        add(w, TRIPTYCH_RENDERER_CPU, s, "%s-rgba16f", name);
        s.splat.target = TRIPTYCH_TARGET_RGBA8;
        add(w, TRIPTYCH_RENDERER_CPU, s, "%s-rgba8", name);
    }
}

/* Adds early termination below and above the defaults. */
static void add_early_terminations(sweep *w)
{
    static const double thresholds[] = { 0, 1.0 / 128, 1.0 / 32 };
    for (size_t i = 0; i < sizeof thresholds / sizeof *thresholds; i++) {
        draw_settings pre = w->pre, post = w->post;
        pre.all.early_termination = post.all.early_termination =
            thresholds[i] > 0 ? thresholds[i] : TRIPTYCH_ZERO;
        add(w, TRIPTYCH_RENDERER_CPU, post, "post-early-termination-%g", thresholds[i]);
        add(w, TRIPTYCH_RENDERER_CPU, pre, "pre-early-termination-%g", thresholds[i]);
    }
}

/* Adds the footprints of splats, their low-pass filters and radii, and the kernels of values. */
static void add_kernels(sweep *w)
{
    static const double radii[] = { 1.5, 2.5, 3 };
    draw_settings s = w->pre;
    s.splat.footprint = TRIPTYCH_FOOTPRINT_EWA;
    add(w, TRIPTYCH_RENDERER_CPU, s, "pre-ewa");
    s.splat.flatten = 3;
    add(w, TRIPTYCH_RENDERER_CPU, s, "pre-ewa-flatten-3");
    s = w->pre;
    s.splat.low_pass = TRIPTYCH_LOW_PASS_NONE;
    add(w, TRIPTYCH_RENDERER_CPU, s, "pre-low-pass-none");
    s = w->pre;
    for (size_t i = 0; i < sizeof radii / sizeof *radii; i++) {
        s.splat.kernel_radius = radii[i];
        add(w, TRIPTYCH_RENDERER_CPU, s, "pre-radius-%g", radii[i]);
    }
    s = w->post;
    s.all.interpolation = TRIPTYCH_INTERPOLATION_CUBIC;
    add(w, TRIPTYCH_RENDERER_CPU, s, "post-cubic");
    s.all.interpolation = TRIPTYCH_INTERPOLATION_GAUSSIAN;
    add(w, TRIPTYCH_RENDERER_CPU, s, "post-gaussian");
}

/* Adds coarse levels, with one ray per pixel and with 2 x 2. */
static void add_levels(sweep *w)
{
    static const double widths[] = { 1, 2, 4 }, widths_of_rays[] = { 0.5, 1 };
    for (size_t i = 0; i < sizeof widths_of_rays / sizeof *widths_of_rays; i++) {
        draw_settings s = w->post;
        s.lod.voxel_px = widths_of_rays[i];
        s.all.samples = 2;
        add(w, TRIPTYCH_RENDERER_CPU, s, "post-lod-%g-samples-2", widths_of_rays[i]);
    }
    for (size_t i = 0; i < sizeof widths / sizeof *widths; i++) {
        draw_settings pre = w->pre, post = w->post;
        pre.lod.voxel_px = post.lod.voxel_px = widths[i];
        add(w, TRIPTYCH_RENDERER_CPU, post, "post-lod-%g", widths[i]);
        add(w, TRIPTYCH_RENDERER_CPU, pre, "pre-lod-%g", widths[i]);
    }
}

static void add_renderers(sweep *w)
{
    draw_settings s = w->post;
    s.all.samples = s.sheet.samples = 0; /* the mean over the area */
    s.lod.voxel_px = 0;
    add(w, TRIPTYCH_RENDERER_GL, w->post, "gl-post");
    add(w, TRIPTYCH_RENDERER_GL, w->pre, "gl-pre");
    add(w, TRIPTYCH_RENDERER_REFERENCE, w->post, "reference-post");
    add(w, TRIPTYCH_RENDERER_REFERENCE, w->pre, "reference-pre");
    s.integral.tolerance = 1e-2;
    add(w, TRIPTYCH_RENDERER_INTEGRAL, s, "integral-0.01");
}

/* Adds several rays per pixel. */
static void add_samples(sweep *w)
{
    static const struct {
        int samples, per_sheet;
    } rows[] = { { 2, 2 }, { 2, 4 }, { 2, 8 }, { 4, 4 }, { 4, 8 } };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        draw_settings s = w->post;
        char per_sheet[32] = "";
        s.all.samples = rows[i].samples;
        s.sheet.samples = rows[i].per_sheet;
        if (s.sheet.samples != w->post.sheet.samples)
            snprintf(per_sheet, sizeof per_sheet, "-samples-per-sheet-%d", s.sheet.samples);
        add(w, TRIPTYCH_RENDERER_CPU, s, "post-samples-%d%s", s.all.samples, per_sheet);
    }
}

draw_settings accuracy_setting_fixed(const draw_settings *defaults, triptych_classify classify)
{
    draw_settings s = *defaults;
    s.all.classify = classify;
    s.all.samples = 1;
    s.lod.voxel_px = TRIPTYCH_ZERO;
    if (classify == TRIPTYCH_CLASSIFY_POST)
        s.sheet.samples = 4;
    return s;
}

int accuracy_settings(accuracy_setting out[ACCURACY_SETTINGS_MAX], const draw_settings *defaults)
{
    sweep w = { .out = out,
                .pre = accuracy_setting_fixed(defaults, TRIPTYCH_CLASSIFY_PRE),
                .post = accuracy_setting_fixed(defaults, TRIPTYCH_CLASSIFY_POST) };
    add_qualities(&w, defaults);
    add_post(&w);
    add_pre(&w, TRIPTYCH_COMPOSITING_SPLAT);
    add_targets(&w);
    add_pre(&w, TRIPTYCH_COMPOSITING_SHEET);
    add_early_terminations(&w);
    add_levels(&w);
    add_kernels(&w);
    add_renderers(&w);
    add_samples(&w);
    return w.count;
}

double accuracy_setting_promise(const accuracy_setting *s)
{
    const triptych_quality quality = s->settings.all.quality;
    return quality ? draw_settings_promise(quality) : 0;
}

/* Target and submission differ in rounding only. The reference renderer does not round. */
bool accuracy_setting_same_reference(const draw_settings *a, const draw_settings *b)
{
    for (int i = 0; i < DRAW_OPTIONS; i++)
        if (i != DRAW_TARGET && i != DRAW_LISTS && i != DRAW_PRIMITIVES &&
            !trip_option_same(&draw_settings_table.rows[i], a, b))
            return false;
    return a->all.quality == b->all.quality;
}

int accuracy_setting_options(const accuracy_setting *one, accuracy_option out[ACCURACY_OPTIONS_MAX])
{
    static const char *const renderers[] = { "auto", "gl", "cpu", "reference", "integral" };
    char value[TRIP_OPTION_TEXT_BYTES];
    int count = 1;
    out[0].name = "renderer";
    snprintf(out[0].value, sizeof out[0].value, "%s", renderers[one->renderer]);
    for (int i = 0; i < DRAW_OPTIONS && count < ACCURACY_OPTIONS_MAX; i++) {
        const trip_option *row = &draw_settings_table.rows[i];
        if (!(row->measured || i == DRAW_QUALITY) || !trip_option_is_set(row, &one->settings))
            continue;
        trip_option_print(row, &one->settings, value);
        out[count].name = row->name;
        snprintf(out[count++].value, sizeof out->value, "%.31s", value);
    }
    return count;
}

bool accuracy_setting_read_option(accuracy_setting *one, const char *name, const char *value)
{
    static const char *const renderers[] = { "auto", "gl", "cpu", "reference", "integral" };
    uint64_t given = 0;
    for (int i = 0; i < 5 && !strcmp(name, "renderer"); i++)
        if (!strcmp(value, renderers[i]))
            return one->renderer = (triptych_renderer)i, true;
    trip_scope quiet = { .sink = trip_report_discard }, *before = trip_scope_enter(&quiet);
    const int status = trip_option_read(&draw_settings_table, name, value, &one->settings, &given);
    trip_scope_enter(before);
    return status == 0;
}
