#include "setting.h"

#include <stdarg.h>
#include <stdio.h>

typedef struct sweep {
    accuracy_setting *out;
    int count;
    triptych_settings pre, post;
} sweep;

__attribute__((format(printf, 4, 5))) static void add(sweep *w, triptych_renderer renderer,
                                                      triptych_settings s, const char *name, ...)
{
    va_list arguments;
    accuracy_setting *one = &w->out[w->count++];
    va_start(arguments, name);
    vsnprintf(one->name, sizeof one->name, name, arguments);
    va_end(arguments);
    one->renderer = renderer;
    one->settings = s;
}

static void add_qualities(sweep *w, const triptych_settings *defaults)
{
    static const char *const names[] = { "draft", "normal", "high", "exact" };
    for (int i = 0; i < 4; i++) {
        triptych_settings s = *defaults;
        triptych_set_quality(&s, (triptych_quality)(TRIPTYCH_DRAFT + i));
        add(w, TRIPTYCH_RENDERER_CPU, s, "quality-%s", names[i]);
    }
}

/* Adds post with each number of samples per sheet, the parameter h of the papers, and the other
 * methods. */
static void add_post(sweep *w)
{
    static const int samples_per_sheet[] = { 1, 2, 3, 4, 6, 8, 16 };
    static const double h[] = { 0, 0.5, 0.7, 0.85, 0.95 };
    triptych_settings s = w->post;
    add(w, TRIPTYCH_RENDERER_CPU, s, "post");
    for (size_t i = 0; i < sizeof samples_per_sheet / sizeof *samples_per_sheet; i++) {
        s.samples_per_sheet = samples_per_sheet[i];
        add(w, TRIPTYCH_RENDERER_CPU, s, "post-samples-per-sheet-%d", samples_per_sheet[i]);
    }
    s = w->post;
    s.method = TRIPTYCH_CLIP;
    add(w, TRIPTYCH_RENDERER_CPU, s, "post-clip");
    s.samples_per_sheet = 1;
    add(w, TRIPTYCH_RENDERER_CPU, s, "post-clip-samples-per-sheet-1");
    s = w->post;
    s.method = TRIPTYCH_AXIS;
    add(w, TRIPTYCH_RENDERER_CPU, s, "post-axis");
    s = w->post;
    for (size_t i = 0; i < sizeof h / sizeof *h; i++) {
        s.h = h[i];
        add(w, TRIPTYCH_RENDERER_CPU, s, "post-h-%g", h[i]);
    }
}

static void add_pre(sweep *w, triptych_compositing compositing)
{
    static const double h[] = { 0, 0.5, 0.95, 0.99 };
    const char *name = compositing == TRIPTYCH_BY_SHEET ? "pre-sheet" : "pre";
    triptych_settings s = w->pre;
    s.compositing = compositing;
    add(w, TRIPTYCH_RENDERER_CPU, s, "%s", name);
    for (size_t i = 0; i < sizeof h / sizeof *h; i++) {
        s.h = h[i];
        add(w, TRIPTYCH_RENDERER_CPU, s, "%s-h-%g", name, h[i]);
    }
    s.h = w->pre.h;
    s.method = TRIPTYCH_CLIP;
    add(w, TRIPTYCH_RENDERER_CPU, s, "%s-clip", name);
    s.method = TRIPTYCH_AXIS;
    add(w, TRIPTYCH_RENDERER_CPU, s, "%s-axis", name);
}

static void add_targets(sweep *w)
{
    for (int sheets = 0; sheets < 2; sheets++) {
        triptych_settings s = w->pre;
        const char *name = sheets ? "pre-sheet" : "pre";
        s.compositing = sheets ? TRIPTYCH_BY_SHEET : TRIPTYCH_BY_SPLAT;
        s.target = TRIPTYCH_RGBA16F;
        add(w, TRIPTYCH_RENDERER_CPU, s, "%s-rgba16f", name);
        s.target = TRIPTYCH_RGBA8;
        add(w, TRIPTYCH_RENDERER_CPU, s, "%s-rgba8", name);
    }
}

/* Adds early termination below and above the defaults. */
static void add_early_terminations(sweep *w)
{
    static const double thresholds[] = { 0, 1.0 / 128, 1.0 / 32 };
    for (size_t i = 0; i < sizeof thresholds / sizeof *thresholds; i++) {
        triptych_settings pre = w->pre, post = w->post;
        pre.early_termination = post.early_termination = thresholds[i];
        add(w, TRIPTYCH_RENDERER_CPU, post, "post-early-termination-%g", thresholds[i]);
        add(w, TRIPTYCH_RENDERER_CPU, pre, "pre-early-termination-%g", thresholds[i]);
    }
}

/* Adds the footprints of splats, their low-pass filters and radii, and the kernels of values. */
static void add_kernels(sweep *w)
{
    static const double radii[] = { 1.5, 2.5, 3 };
    triptych_settings s = w->pre;
    s.footprint = TRIPTYCH_FOOTPRINT_EWA;
    add(w, TRIPTYCH_RENDERER_CPU, s, "pre-ewa");
    s.flatten = 3;
    add(w, TRIPTYCH_RENDERER_CPU, s, "pre-ewa-flatten-3");
    s = w->pre;
    s.low_pass = TRIPTYCH_LOW_PASS_NONE;
    add(w, TRIPTYCH_RENDERER_CPU, s, "pre-low-pass-none");
    s = w->pre;
    for (size_t i = 0; i < sizeof radii / sizeof *radii; i++) {
        s.kernel_radius = radii[i];
        add(w, TRIPTYCH_RENDERER_CPU, s, "pre-radius-%g", radii[i]);
    }
    s = w->post;
    s.kernel = TRIPTYCH_CUBIC;
    add(w, TRIPTYCH_RENDERER_CPU, s, "post-cubic");
    s.kernel = TRIPTYCH_GAUSSIAN;
    add(w, TRIPTYCH_RENDERER_CPU, s, "post-gaussian");
}

static void add_levels(sweep *w)
{
    static const double widths[] = { 1, 2, 4 };
    for (size_t i = 0; i < sizeof widths / sizeof *widths; i++) {
        triptych_settings pre = w->pre, post = w->post;
        pre.lod_px = post.lod_px = widths[i];
        add(w, TRIPTYCH_RENDERER_CPU, post, "post-lod-%g", widths[i]);
        add(w, TRIPTYCH_RENDERER_CPU, pre, "pre-lod-%g", widths[i]);
    }
}

static void add_renderers(sweep *w)
{
    triptych_settings s = w->post;
    add(w, TRIPTYCH_RENDERER_GL, w->post, "gl-post");
    add(w, TRIPTYCH_RENDERER_GL, w->pre, "gl-pre");
    add(w, TRIPTYCH_RENDERER_REFERENCE, w->post, "reference-post");
    add(w, TRIPTYCH_RENDERER_REFERENCE, w->pre, "reference-pre");
    s.tolerance = 1e-2;
    add(w, TRIPTYCH_RENDERER_INTEGRAL, s, "integral-0.01");
}

static void add_samples(sweep *w)
{
    static const int samples[] = { 2, 4 };
    for (size_t i = 0; i < sizeof samples / sizeof *samples; i++) {
        triptych_settings s = w->post;
        s.samples = samples[i];
        add(w, TRIPTYCH_RENDERER_CPU, s, "post-samples-%d", samples[i]);
    }
}

int accuracy_settings(accuracy_setting out[ACCURACY_SETTINGS_MAX],
                      const triptych_settings *defaults)
{
    sweep w = { .out = out, .pre = *defaults, .post = *defaults };
    w.pre.classify = TRIPTYCH_PRE;
    w.post.classify = TRIPTYCH_POST;
    add_qualities(&w, defaults);
    add_post(&w);
    add_pre(&w, TRIPTYCH_BY_SPLAT);
    add_targets(&w);
    add_pre(&w, TRIPTYCH_BY_SHEET);
    add_early_terminations(&w);
    add_levels(&w);
    add_kernels(&w);
    add_renderers(&w);
    add_samples(&w);
    return w.count;
}

bool accuracy_setting_same_reference(const triptych_settings *a, const triptych_settings *b)
{
    if (a->classify != b->classify || a->method != b->method || a->lod_px != b->lod_px ||
        a->early_termination != b->early_termination || a->samples != b->samples ||
        (a->method == TRIPTYCH_MERGE && a->h != b->h))
        return false;
    if (a->classify == TRIPTYCH_PRE)
        return a->compositing == b->compositing && a->kernel_radius == b->kernel_radius &&
               a->footprint == b->footprint && a->low_pass == b->low_pass &&
               a->flatten == b->flatten;
    return a->samples_per_sheet == b->samples_per_sheet && a->kernel == b->kernel;
}
