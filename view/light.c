#include "light.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "text.h"

#define DEGREE 0.017453292519943295

static double half_diagonal(const triptych_info *info)
{
    double sum = 0;
    for (int i = 0; i < 3; i++)
        sum += (info->hi[i] - info->lo[i]) * (info->hi[i] - info->lo[i]);
    return 0.5 * sqrt(sum);
}

static double middle(const triptych_info *info, int i)
{
    return 0.5 * (info->lo[i] + info->hi[i]);
}

trip_light_control trip_light_control_of(const triptych_settings *s, const triptych_info *info)
{
    double way[3];
    for (int i = 0; i < 3; i++)
        way[i] = s->light[i] - (s->point_light ? middle(info, i) : 0);
    const double length = hypot(hypot(way[0], way[1]), way[2]), unit = half_diagonal(info);
    return (trip_light_control){
        .round = atan2(way[1], way[0]) / DEGREE,
        .up = length > 0 ? asin(way[2] / length) / DEGREE : 90,
        .distance = s->point_light && unit > 0 ? length / unit : TRIP_LIGHT_FARTHEST,
    };
}

void trip_light_control_set(triptych_settings *s, const triptych_info *info,
                            const trip_light_control *control)
{
    const double round = control->round * DEGREE, up = control->up * DEGREE;
    const double way[3] = { cos(up) * cos(round), cos(up) * sin(round), sin(up) };
    const double distance = control->distance * half_diagonal(info);
    s->headlight = 0;
    s->point_light = control->distance < TRIP_LIGHT_FARTHEST;
    for (int i = 0; i < 3; i++)
        s->light[i] = s->point_light ? middle(info, i) + distance * way[i] : way[i];
}

char *trip_light_text(const triptych_settings *s)
{
    char *text = NULL, x[32], y[32], z[32];
    if (s->headlight || !(s->shading || s->effects))
        return strdup("");
    if (asprintf(&text, " --light %s%s,%s,%s", s->point_light ? "point:" : "",
                 trip_text_from_double(s->light[0], x), trip_text_from_double(s->light[1], y),
                 trip_text_from_double(s->light[2], z)) < 0)
        return NULL;
    return text;
}

/* ---- effects ---- */

const trip_effect_switch trip_effect_switches[TRIP_EFFECT_SWITCHES] = {
    { TRIPTYCH_SHADOWS, "shadows", "Shadows", "shadows" },
    { TRIPTYCH_OCCLUSION, "occlusion", "Occlusion", "occlusion" },
    { TRIPTYCH_CUEING, "cueing", "Depth cueing", "depth cueing" },
    { TRIPTYCH_EFFECTS_AUTO, "auto", "Automatic effects", "effects chosen by the kind of data" },
    { TRIPTYCH_EMISSION, "emission", "Emission", "emission" },
};

#define AT(member) offsetof(triptych_settings, member)
#define HOTTEST 12000
#define LATTICES (TRIPTYCH_SHADOWS | TRIPTYCH_OCCLUSION | TRIPTYCH_EMISSION)

const trip_effect_number trip_effect_numbers[TRIP_EFFECT_NUMBERS] = {
    { TRIPTYCH_SHADOWS, "anisotropy", "Anisotropy", "", AT(anisotropy), false, -0.95, 0.95, 0.05 },
    { LATTICES, "light-cells", "Light cells", "", AT(light_cells), true, 8, 1024, 1 },
    { TRIPTYCH_CUEING, "fading", "Cueing strength", "", AT(cueing), false, 0.01, 1, 0.01 },
    { TRIPTYCH_EMISSION, "coldest", "Minimum temperature", "K", AT(kelvin[0]), false, 0,
      HOTTEST - 1, 1 },
    { TRIPTYCH_EMISSION, "hottest", "Maximum temperature", "K", AT(kelvin[1]), false, 1, HOTTEST,
      1 },
};

const char *trip_effect_lacks(const trip_effect_switch *effect, const triptych_settings *s,
                              const char *heat)
{
    if (effect->bit == TRIPTYCH_SHADOWS && s->headlight)
        return "the light is the headlight";
    return effect->bit == TRIPTYCH_EMISSION && !heat ? "no heat data set (--emission)" : NULL;
}

bool trip_effect_turn(const trip_effect_switch *effect, bool on, triptych_settings *s,
                      const char *heat)
{
    if (on && trip_effect_lacks(effect, s, heat))
        return false;
    s->effects = on ? s->effects | effect->bit : s->effects & ~effect->bit;
    return true;
}

bool trip_effect_number_is_below(const trip_effect_number *number, const trip_effect_switch *effect,
                                 const triptych_settings *s)
{
    const int on = number->bits & s->effects;
    int i = 0;
    while (!(trip_effect_switches[i].bit & (on ? on : number->bits)))
        i++;
    return effect == &trip_effect_switches[i];
}

double trip_effect_number_get(const trip_effect_number *number, const triptych_settings *s)
{
    const char *at = (const char *)s + number->at;
    return number->whole ? *(const int *)at : *(const double *)at;
}

bool trip_effect_number_set(const trip_effect_number *number, double value, triptych_settings *s)
{
    char *at = (char *)s + number->at;
    if (!(value >= number->lo && value <= number->hi) || (number->whole && value != floor(value)))
        return false;
    if (number->whole)
        *(int *)at = (int)value;
    else
        *(double *)at = value;
    if (!(s->kelvin[0] < s->kelvin[1]) && number->at == AT(kelvin[0]))
        s->kelvin[1] = s->kelvin[0] + 1;
    else if (!(s->kelvin[0] < s->kelvin[1]))
        s->kelvin[0] = s->kelvin[1] - 1;
    return true;
}

static bool may_glow(const triptych_settings *s, const char *heat)
{
    return heat && s->effects & (TRIPTYCH_EMISSION | TRIPTYCH_EFFECTS_AUTO);
}

/* Returns whether the number differs from its default and one of its effects can run. */
static void put_number(FILE *out, const char *option, double number, double defaults, int some)
{
    char text[32];
    if (some && number != defaults)
        fprintf(out, " %s %s", option, trip_text_from_double(number, text));
}

static void put_effects(FILE *out, const triptych_settings *s, const char *heat)
{
    const triptych_settings defaults = triptych_default_settings();
    const char *before = " --effects ";
    for (int i = 0; i < TRIP_EFFECT_SWITCHES; i++)
        if (s->effects & trip_effect_switches[i].bit) {
            fprintf(out, "%s%s", before, trip_effect_switches[i].name);
            before = ",";
        }
    const int some = s->effects & TRIPTYCH_EFFECTS_AUTO ? ~0 : s->effects;
    put_number(out, "--anisotropy", s->anisotropy, defaults.anisotropy, some & TRIPTYCH_SHADOWS);
    put_number(out, "--cueing", s->cueing, defaults.cueing, some & TRIPTYCH_CUEING);
    put_number(out, "--light-cells", s->light_cells, defaults.light_cells, some & LATTICES);
    if (!may_glow(s, heat))
        return;
    char lo[32], hi[32];
    fputs(" --emission ", out);
    trip_text_write_word(out, heat);
    fprintf(out, " --temperature %s:%s", trip_text_from_double(s->kelvin[0], lo),
            trip_text_from_double(s->kelvin[1], hi));
}

char *trip_effects_text(const triptych_settings *s, const char *heat)
{
    char *text = NULL;
    size_t bytes;
    if (!s->effects)
        return strdup("");
    FILE *out = open_memstream(&text, &bytes);
    if (!out)
        return NULL;
    put_effects(out, s, heat);
    if (fclose(out) == 0)
        return text;
    free(text);
    return NULL;
}

void trip_effects_say(const triptych_settings *s, const char *heat, char *text, size_t bytes)
{
    size_t at = 0;
    text[0] = 0;
    for (int i = 0; i < TRIP_EFFECT_SWITCHES && at < bytes; i++)
        if (s->effects & trip_effect_switches[i].bit)
            at += (size_t)snprintf(text + at, bytes - at, "%s%s", at ? ", " : "",
                                   trip_effect_switches[i].words);
    if (may_glow(s, heat) && at < bytes) {
        const char *name = strrchr(heat, '/');
        snprintf(text + at, bytes - at, "%s of %s, %g to %g K",
                 s->effects & TRIPTYCH_EMISSION ? "" : ", emission", name ? name + 1 : heat,
                 s->kelvin[0], s->kelvin[1]);
    }
}
