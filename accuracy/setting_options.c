/* Converts settings to options of `triptych render`, and back. */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "setting.h"
#include "text.h"

static const char *const renderers[] = { "auto", "gl", "cpu", "reference", "integral", NULL };
static const char *const classifies[] = { "pre", "post", "auto", NULL };
static const char *const compositings[] = { "splat", "sheet", NULL };
static const char *const targets[] = { "rgba32f", "rgba16f", "rgba8", NULL };
static const char *const footprints[] = { "exact", "ewa", "fixed", NULL };
static const char *const low_passes[] = { "ewa", "uniform", "none", NULL };
static const char *const kernels[] = { "linear", "cubic", "gaussian", NULL };
static const char *const methods[] = { "merge", "clip", "axis", NULL };

__attribute__((format(printf, 4, 5))) static void put(accuracy_option *out, int *count,
                                                      const char *name, const char *value, ...)
{
    va_list arguments;
    va_start(arguments, value);
    out[*count].name = name;
    vsnprintf(out[*count].value, sizeof out->value, value, arguments);
    va_end(arguments);
    (*count)++;
}

static void put_pre(const triptych_settings *s, accuracy_option *out, int *count)
{
    put(out, count, "classify", "pre");
    put(out, count, "compositing", "%s", compositings[s->compositing]);
    if (s->footprint != TRIPTYCH_FOOTPRINT_EXACT)
        put(out, count, "kernel", "%s", footprints[s->footprint]);
    if (s->flatten > 1)
        put(out, count, "flatten", "%g", s->flatten);
    if (s->low_pass != TRIPTYCH_LOW_PASS_EWA)
        put(out, count, "low-pass", "%s", low_passes[s->low_pass]);
    put(out, count, "kernel-radius", "%g", s->kernel_radius);
    put(out, count, "target", "%s", targets[s->target]);
}

int accuracy_setting_options(const accuracy_setting *one, accuracy_option out[ACCURACY_OPTIONS_MAX])
{
    const triptych_settings *s = &one->settings;
    int count = 0;
    put(out, &count, "renderer", "%s", renderers[one->renderer]);
    if (s->samples != 1)
        put(out, &count, "samples", "%d", s->samples);
    if (one->renderer == TRIPTYCH_RENDERER_INTEGRAL) {
        put(out, &count, "tolerance", "%g", s->tolerance);
        return count;
    }
    if (s->classify == TRIPTYCH_PRE)
        put_pre(s, out, &count);
    else {
        put(out, &count, "classify", "%s", classifies[s->classify]);
        if (s->kernel != TRIPTYCH_LINEAR)
            put(out, &count, "kernel", "%s", kernels[s->kernel]);
        if (s->samples_per_sheet)
            put(out, &count, "samples-per-sheet", "%d", s->samples_per_sheet);
    }
    if (one->renderer == TRIPTYCH_RENDERER_REFERENCE && s->classify == TRIPTYCH_PRE)
        count--; /* removes the target, which this renderer lacks */
    put(out, &count, "method", "%s", methods[s->method]);
    if (s->method == TRIPTYCH_MERGE && s->h >= 0)
        put(out, &count, "h", "%g", s->h);
    if (s->early_termination >= 0)
        put(out, &count, "early-termination", "%.10g", s->early_termination);
    if (s->lod_px > 0)
        put(out, &count, "lod", "%g", s->lod_px);
    return count;
}

static int find(const char *text, const char *const *names)
{
    for (int i = 0; names[i]; i++)
        if (!strcmp(text, names[i]))
            return i;
    return -1;
}

static bool read_integer(const char *text, int *out)
{
    double number;
    if (!trip_text_to_double(text, &number) || !(number >= 0 && number <= 1000) ||
        number != (int)number)
        return false;
    *out = (int)number;
    return true;
}

static bool read_number(const char *name, const char *text, triptych_settings *s)
{
    if (!strcmp(name, "samples"))
        return read_integer(text, &s->samples);
    if (!strcmp(name, "samples-per-sheet"))
        return read_integer(text, &s->samples_per_sheet);
    double *number = !strcmp(name, "h")                   ? &s->h
                     : !strcmp(name, "kernel-radius")     ? &s->kernel_radius
                     : !strcmp(name, "flatten")           ? &s->flatten
                     : !strcmp(name, "early-termination") ? &s->early_termination
                     : !strcmp(name, "lod")               ? &s->lod_px
                     : !strcmp(name, "tolerance")         ? &s->tolerance
                                                          : NULL;
    return number && trip_text_to_double(text, number);
}

bool accuracy_setting_read_option(accuracy_setting *one, const char *name, const char *value)
{
    triptych_settings *s = &one->settings;
    int which;
    if (!strcmp(name, "renderer") && (which = find(value, renderers)) >= 0)
        return one->renderer = (triptych_renderer)which, true;
    if (!strcmp(name, "classify") && (which = find(value, classifies)) >= 0)
        return s->classify = (triptych_classify)which, true;
    if (!strcmp(name, "compositing") && (which = find(value, compositings)) >= 0)
        return s->compositing = (triptych_compositing)which, true;
    if (!strcmp(name, "kernel") && (which = find(value, footprints)) >= 0)
        return s->footprint = (triptych_footprint)which, true;
    if (!strcmp(name, "kernel") && (which = find(value, kernels)) >= 0)
        return s->kernel = (triptych_kernel)which, true;
    if (!strcmp(name, "low-pass") && (which = find(value, low_passes)) >= 0)
        return s->low_pass = (triptych_low_pass)which, true;
    if (!strcmp(name, "target") && (which = find(value, targets)) >= 0)
        return s->target = (triptych_target)which, true;
    if (!strcmp(name, "method") && (which = find(value, methods)) >= 0)
        return s->method = (triptych_method)which, true;
    return read_number(name, value, s);
}
