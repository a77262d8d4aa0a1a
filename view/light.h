/* Controls for light and effects, for the window and the browser: their values and names. Pure
 * functions on plain values. */
#ifndef TRIP_VIEW_LIGHT_H
#define TRIP_VIEW_LIGHT_H

#include <stdbool.h>
#include <stddef.h>

#include "draw_settings.h"
#include "navigation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Limits of the light's distance, in half diagonals of the data. At the farthest distance the light
 * is directional, nearer it is a point light. */
#define TRIP_LIGHT_NEAREST 0.02
#define TRIP_LIGHT_FARTHEST 10.0

/* Place of the light in degrees and half diagonals. A light that turns with the view is far away.
 * Its azimuth counts from the front to the left, its elevation to the top of the picture. Other
 * lights lie around the centre of the data. Their azimuth counts from the x axis towards y, their
 * elevation towards z. */
typedef struct trip_light_control {
    bool turns; /* with the view */
    double round, up;
    double distance;
} trip_light_control;

/* Converts a light that is not the headlight. */
trip_light_control trip_light_control_of(const draw_settings *s, const triptych_info *info);
void trip_light_control_set(draw_settings *s, const triptych_info *info,
                            const trip_light_control *control);

/* Puts the light at the eye, or takes it from there to its last direction that turned with the
 * view. The first one is the upper left front. */
void trip_light_set_head(draw_settings *s, bool head);
/* Lets the light turn with the view, or fixes it in the world. The picture of the view `n` stays
 * the same, except for a light that leaves its position. */
void trip_light_set_turns(draw_settings *s, const triptych_info *info, const trip_navigation *n,
                          bool turns);
/* Returns whether light shades the data. `lit` tells whether the default light does, as in volumes;
 * other clouds are lit if a light is given. */
bool trip_light_shades(const draw_settings *s, bool lit);
void trip_light_set_shading(draw_settings *s, bool lit, bool shading);
/* Returns whether the light is at the eye. The default is another light with shadows. */
static inline bool trip_light_is_head(const draw_settings *s)
{
    return s->light.kind == TRIPTYCH_LIGHT_HEAD || (s->light.kind == TRIPTYCH_LIGHT_DEFAULT &&
                                                    !(s->effects.which & TRIPTYCH_EFFECT_SHADOWS));
}
/* Writes the names of the active effects into `text`, cut to `bytes`; "" without effects. */
void trip_effects_say(const draw_settings *s, const char *heat, char *text, size_t bytes);

/* ---- effects as controls ---- */

enum { TRIP_EFFECT_SWITCHES = 6, TRIP_EFFECT_NUMBERS = 7 };

typedef struct trip_effect_switch {
    int bit;                          /* of triptych_effects.which */
    const char *name, *label, *words; /* name as in --effects; texts for people */
} trip_effect_switch;

/* A number that applies while one of its effects is on. */
typedef struct trip_effect_number {
    int bits; /* of the effects that use the number */
    const char *name, *label, *unit;
    size_t at;  /* offset in draw_settings */
    bool whole; /* the member is an int, not a double */
    double lo, hi, step, standard;
} trip_effect_number;

extern const trip_effect_switch trip_effect_switches[TRIP_EFFECT_SWITCHES];
extern const trip_effect_number trip_effect_numbers[TRIP_EFFECT_NUMBERS];

/* Returns whether the kind of data can have the effect. */
static inline bool trip_effect_applies(const trip_effect_switch *effect, int kind)
{
    return (draw_settings_effects_of_kind(kind) & effect->bit) != 0;
}
/* Returns why the effect cannot run, as text for people, or NULL if it can. `heat` is the heat data
 * set or NULL. */
const char *trip_effect_lacks(const trip_effect_switch *effect, const draw_settings *s,
                              const char *heat);
/* Switches an effect. Returns false, and changes nothing, if it cannot run. Shadows take the
 * default light from the eye to the upper left front of the view. */
bool trip_effect_turn(const trip_effect_switch *effect, bool on, draw_settings *s,
                      const char *heat);
/* Returns whether the number's control belongs below this effect's switch. Each number belongs to
 * its first effect that is on, or else to its first effect. */
bool trip_effect_number_is_below(const trip_effect_number *number, const trip_effect_switch *effect,
                                 const draw_settings *s);
double trip_effect_number_get(const trip_effect_number *number, const draw_settings *s);
/* Sets the number. Returns false, and changes nothing, if the value is out of bounds or not whole
 * where it must be. The minimum and maximum temperature push one another. */
bool trip_effect_number_set(const trip_effect_number *number, double value, draw_settings *s);

#ifdef __cplusplus
}
#endif

#endif
