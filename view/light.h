/* Controls for light and effects, for the window and the browser: their values and names. Pure
 * functions on plain values. */
#ifndef TRIP_VIEW_LIGHT_H
#define TRIP_VIEW_LIGHT_H

#include <stdbool.h>
#include <stddef.h>

#include "draw_settings.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Limits of the light's distance, in half diagonals of the data. At the farthest distance the light
 * is directional, nearer it is a point light. */
#define TRIP_LIGHT_NEAREST 0.02
#define TRIP_LIGHT_FARTHEST 10.0

/* Position of the light, relative to the centre of the data. */
typedef struct trip_light_control {
    double round, up; /* azimuth from the x axis towards y, elevation towards z; degrees */
    double distance;
} trip_light_control;

/* Converts a light that is not the headlight. */
trip_light_control trip_light_control_of(const draw_settings *s, const triptych_info *info);
void trip_light_control_set(draw_settings *s, const triptych_info *info,
                            const trip_light_control *control);

/* Puts the light at the eye, or takes it from there to its last direction or position. */
void trip_light_set_head(draw_settings *s, bool head);
static inline bool trip_light_is_head(const draw_settings *s)
{
    return s->light.kind < TRIPTYCH_LIGHT_DIRECTION;
}
/* Writes the names of the active effects into `text`, cut to `bytes`; "" without effects. */
void trip_effects_say(const draw_settings *s, const char *heat, char *text, size_t bytes);

/* ---- effects as controls ---- */

enum { TRIP_EFFECT_SWITCHES = 5, TRIP_EFFECT_NUMBERS = 5 };

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

/* Returns why the effect cannot run, as text for people, or NULL if it can. `heat` is the heat data
 * set or NULL. */
const char *trip_effect_lacks(const trip_effect_switch *effect, const draw_settings *s,
                              const char *heat);
/* Switches an effect. Returns false, and changes nothing, if it cannot run. */
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
