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

static bool is_point(const draw_settings *s)
{
    return s->light.kind == TRIPTYCH_LIGHT_POINT;
}

/* Orders the components of a direction as x, y and z of the world: front, left, up. */
static void reorder(const double toward[3], double way[3])
{
    way[0] = toward[2];
    way[1] = toward[0];
    way[2] = toward[1];
}

/* Returns the direction to the light. */
static void way_of(const draw_settings *s, const triptych_info *info, double way[3])
{
    for (int i = 0; i < 3; i++)
        way[i] = s->light.toward[i] - (is_point(s) ? middle(info, i) : 0);
}

trip_light_control trip_light_control_of(const draw_settings *s, const triptych_info *info)
{
    static const double upper_left_front[3] = { 1, 1, 1 };
    const bool chosen = s->light.kind < TRIPTYCH_LIGHT_DIRECTION;
    const bool turns = chosen || s->light.kind == TRIPTYCH_LIGHT_VIEW;
    double way[3];
    way_of(s, info, way);
    if (turns)
        reorder(chosen ? upper_left_front : s->light.toward, way);
    const double length = hypot(hypot(way[0], way[1]), way[2]), unit = half_diagonal(info);
    return (trip_light_control){
        .turns = turns,
        .round = atan2(way[1], way[0]) / DEGREE,
        .up = length > 0 ? asin(way[2] / length) / DEGREE : 90,
        .distance = is_point(s) && unit > 0 ? length / unit : TRIP_LIGHT_FARTHEST,
    };
}

void trip_light_control_set(draw_settings *s, const triptych_info *info,
                            const trip_light_control *control)
{
    const double round = control->round * DEGREE, up = control->up * DEGREE;
    const double way[3] = { cos(up) * cos(round), cos(up) * sin(round), sin(up) };
    const double distance = control->distance * half_diagonal(info);
    s->light.kind = control->turns                            ? TRIPTYCH_LIGHT_VIEW
                    : control->distance < TRIP_LIGHT_FARTHEST ? TRIPTYCH_LIGHT_POINT
                                                              : TRIPTYCH_LIGHT_DIRECTION;
    if (control->turns) {
        s->light.toward[0] = way[1];
        s->light.toward[1] = way[2];
        s->light.toward[2] = way[0];
        return;
    }
    for (int i = 0; i < 3; i++)
        s->light.toward[i] = is_point(s) ? middle(info, i) + distance * way[i] : way[i];
}

static bool is_zero(const double v[3])
{
    return !(hypot(hypot(v[0], v[1]), v[2]) > 0);
}

void trip_light_set_head(draw_settings *s, bool head)
{
    triptych_light *l = &s->light;
    if (l->kind == TRIPTYCH_LIGHT_DIRECTION || l->kind == TRIPTYCH_LIGHT_POINT)
        memset(l->toward, 0, sizeof l->toward); /* it is no direction of the view */
    l->kind = head ? TRIPTYCH_LIGHT_HEAD : TRIPTYCH_LIGHT_VIEW;
    for (int i = 0, none = is_zero(l->toward); i < 3 && !head && none; i++)
        l->toward[i] = 1;
}

/* Returns the view's axes in the world: left, up, front. */
static void axes_of(const trip_navigation *n, double axes[3][3])
{
    const trip_navigation_axes a = trip_navigation_get_axes(n);
    for (int i = 0; i < 3; i++) {
        axes[0][i] = -a.right[i];
        axes[1][i] = a.up[i];
        axes[2][i] = -a.forward[i];
    }
}

void trip_light_set_turns(draw_settings *s, const triptych_info *info, const trip_navigation *n,
                          bool turns)
{
    double axes[3][3], way[3], toward[3] = { 0 };
    if (s->light.kind == TRIPTYCH_LIGHT_DEFAULT)
        trip_light_set_head(s, false);
    if (trip_light_is_head(s) || turns == (s->light.kind == TRIPTYCH_LIGHT_VIEW))
        return;
    axes_of(n, axes);
    way_of(s, info, way);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            toward[i] += turns ? axes[i][k] * way[k] : axes[k][i] * way[k];
    s->light.kind = turns ? TRIPTYCH_LIGHT_VIEW : TRIPTYCH_LIGHT_DIRECTION;
    memcpy(s->light.toward, toward, sizeof toward);
    if (is_zero(toward)) /* a light at the centre */
        s->light.toward[2] = 1;
}

bool trip_light_shades(const draw_settings *s, bool lit)
{
    return !s->light.no_shading && (lit || s->light.kind != TRIPTYCH_LIGHT_DEFAULT);
}

void trip_light_set_shading(draw_settings *s, bool lit, bool shading)
{
    s->light.no_shading = !shading;
    if (shading && !lit && s->light.kind == TRIPTYCH_LIGHT_DEFAULT)
        s->light.kind = TRIPTYCH_LIGHT_HEAD;
}

/* ---- effects ---- */

const trip_effect_switch trip_effect_switches[TRIP_EFFECT_SWITCHES] = {
    { TRIPTYCH_EFFECT_SHADOWS, "shadows", "Shadows", "shadows" },
    { TRIPTYCH_EFFECT_OCCLUSION, "occlusion", "Occlusion", "occlusion" },
    { TRIPTYCH_EFFECT_CUEING, "cueing", "Depth cueing", "depth cueing" },
    { TRIPTYCH_EFFECT_AUTO, "auto", "Automatic effects", "effects chosen by the kind of data" },
    { TRIPTYCH_EFFECT_EMISSION, "emission", "Emission", "emission" },
    { TRIPTYCH_EFFECT_EDL, "edl", "Eye-dome lighting", "eye-dome lighting" },
};

#define AT(member) offsetof(draw_settings, effects.member)
#define HOTTEST 12000
#define DEFAULT_HOTTEST 2500
#define LATTICES (TRIPTYCH_EFFECT_SHADOWS | TRIPTYCH_EFFECT_OCCLUSION | TRIPTYCH_EFFECT_EMISSION)

const trip_effect_number trip_effect_numbers[TRIP_EFFECT_NUMBERS] = {
    { TRIPTYCH_EFFECT_SHADOWS, "anisotropy", "Anisotropy", "", AT(anisotropy), false, -0.95, 0.95,
      0.05, 0 },
    { LATTICES, "light-cells", "Light cells", "", AT(light_cells), true, 8, 1024, 1, 128 },
    { TRIPTYCH_EFFECT_CUEING, "fading", "Cueing strength", "", AT(cueing), false, 0.01, 1, 0.01,
      0.6 },
    { TRIPTYCH_EFFECT_EMISSION, "coldest", "Minimum temperature", "K", AT(kelvin[0]), false, 0,
      HOTTEST - 1, 1, 0 },
    { TRIPTYCH_EFFECT_EMISSION, "hottest", "Maximum temperature", "K", AT(kelvin[1]), false, 1,
      HOTTEST, 1, DEFAULT_HOTTEST },
    { TRIPTYCH_EFFECT_EDL, "edl-strength", "Dome strength", "", AT(edl_strength), false, 0.01, 5,
      0.01, 0.4 },
    { TRIPTYCH_EFFECT_EDL, "edl-radius", "Dome radius", "px", AT(edl_radius_px), false, 1, 16, 0.1,
      1.4 },
};

const char *trip_effect_lacks(const trip_effect_switch *effect, const draw_settings *s,
                              const char *heat)
{
    if (effect->bit == TRIPTYCH_EFFECT_SHADOWS && s->light.kind == TRIPTYCH_LIGHT_HEAD)
        return "the light is the headlight";
    return effect->bit == TRIPTYCH_EFFECT_EMISSION && !heat ? "no heat data set (--emission)"
                                                            : NULL;
}

bool trip_effect_turn(const trip_effect_switch *effect, bool on, draw_settings *s, const char *heat)
{
    if (on && trip_effect_lacks(effect, s, heat))
        return false;
    if (on && effect->bit == TRIPTYCH_EFFECT_SHADOWS && trip_light_is_head(s))
        trip_light_set_head(s, false);
    s->effects.which = on ? s->effects.which | effect->bit : s->effects.which & ~effect->bit;
    return true;
}

bool trip_effect_number_is_below(const trip_effect_number *number, const trip_effect_switch *effect,
                                 const draw_settings *s)
{
    const int on = number->bits & s->effects.which;
    int i = 0;
    while (!(trip_effect_switches[i].bit & (on ? on : number->bits)))
        i++;
    return effect == &trip_effect_switches[i];
}

double trip_effect_number_get(const trip_effect_number *number, const draw_settings *s)
{
    const char *at = (const char *)s + number->at;
    const double value = number->whole ? *(const int *)at : *(const double *)at;
    return value == 0 ? number->standard : value;
}

bool trip_effect_number_set(const trip_effect_number *number, double value, draw_settings *s)
{
    char *at = (char *)s + number->at;
    if (!(value >= number->lo && value <= number->hi) || (number->whole && value != floor(value)))
        return false;
    if (!(s->effects.kelvin[1] > 0))
        s->effects.kelvin[1] = DEFAULT_HOTTEST;
    if (number->whole)
        *(int *)at = (int)value;
    else
        *(double *)at = value;
    if (!(s->effects.kelvin[0] < s->effects.kelvin[1]) && number->at == AT(kelvin[0]))
        s->effects.kelvin[1] = s->effects.kelvin[0] + 1;
    else if (!(s->effects.kelvin[0] < s->effects.kelvin[1]))
        s->effects.kelvin[0] = s->effects.kelvin[1] - 1;
    return true;
}

static bool may_glow(const draw_settings *s, const char *heat)
{
    return heat && s->effects.which & (TRIPTYCH_EFFECT_EMISSION | TRIPTYCH_EFFECT_AUTO);
}

void trip_effects_say(const draw_settings *s, const char *heat, char *text, size_t bytes)
{
    size_t at = 0;
    text[0] = 0;
    for (int i = 0; i < TRIP_EFFECT_SWITCHES && at < bytes; i++)
        if (s->effects.which & trip_effect_switches[i].bit)
            at += (size_t)snprintf(text + at, bytes - at, "%s%s", at ? ", " : "",
                                   trip_effect_switches[i].words);
    if (may_glow(s, heat) && at < bytes) {
        const char *name = strrchr(heat, '/');
        snprintf(text + at, bytes - at, "%s of %s, %g to %g K",
                 s->effects.which & TRIPTYCH_EFFECT_EMISSION ? "" : ", emission",
                 name ? name + 1 : heat, s->effects.kelvin[0],
                 s->effects.kelvin[1] > 0 ? s->effects.kelvin[1] : DEFAULT_HOTTEST);
    }
}
