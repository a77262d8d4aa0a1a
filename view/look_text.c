#include "look_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "text.h"

static void put_number(FILE *out, const char *option, double number)
{
    char text[32];
    fprintf(out, " --%s %s", option, trip_text_from_double(number, text));
}

static void put_function(FILE *out, const char *function, double opacity_scale)
{
    if (function) {
        fputs(" --tf ", out);
        trip_text_write_word(out, function);
    }
    if (opacity_scale != 1)
        put_number(out, "opacity-scale", opacity_scale);
}

static void put_classification(FILE *out, const triptych_settings *s,
                               const triptych_settings *defaults)
{
    if (s->classify != defaults->classify)
        fprintf(out, " --classify %s", s->classify == TRIPTYCH_PRE ? "pre" : "post");
    if (s->classify != TRIPTYCH_PRE && s->samples_per_sheet != defaults->samples_per_sheet)
        fprintf(out, " --samples-per-sheet %d", s->samples_per_sheet);
    if (s->classify == TRIPTYCH_PRE && s->compositing == TRIPTYCH_BY_SHEET)
        fputs(" --compositing sheet", out);
    if (s->classify == TRIPTYCH_PRE && s->kernel_radius != defaults->kernel_radius)
        put_number(out, "kernel-radius", s->kernel_radius);
}

static void put_method(FILE *out, const triptych_settings *s, const triptych_settings *defaults)
{
    static const char *const methods[] = { "merge", "clip", "axis", "image" };
    if (s->method != defaults->method)
        fprintf(out, " --method %s", methods[s->method]);
    if (s->method == TRIPTYCH_MERGE && s->h != defaults->h)
        put_number(out, "h", s->h);
    if (s->early_termination != defaults->early_termination)
        put_number(out, "early-termination", s->early_termination);
    if (s->lod_px != defaults->lod_px)
        put_number(out, "lod", s->lod_px);
    if (s->samples != defaults->samples)
        fprintf(out, " --samples %d", s->samples);
}

static void put_colours(FILE *out, const triptych_settings *s, const triptych_settings *defaults)
{
    static const char *const shown[] = { "picture", "lists", "merge", "levels" };
    char part[4][32];
    if (!s->shading)
        fputs(" --no-shading", out);
    if (s->show != defaults->show)
        fprintf(out, " --show %s", shown[s->show]);
    if (memcmp(s->background, defaults->background, sizeof s->background) == 0)
        return;
    for (int i = 0; i < 4; i++)
        trip_text_from_double(s->background[i], part[i]);
    fprintf(out, " --background %s,%s,%s,%s", part[0], part[1], part[2], part[3]);
}

char *trip_look_text(const triptych_settings *s, const char *function, double opacity_scale)
{
    const triptych_settings defaults = triptych_default_settings();
    char *text = NULL;
    size_t bytes;
    FILE *out = open_memstream(&text, &bytes);
    if (!out)
        return NULL;
    put_function(out, function, opacity_scale);
    put_classification(out, s, &defaults);
    put_method(out, s, &defaults);
    put_colours(out, s, &defaults);
    if (fclose(out) == 0)
        return text;
    free(text);
    return NULL;
}
