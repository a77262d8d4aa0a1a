/* The light and effects as controls have them, in the window and in a browser alike, as options and
 * in words. Plain values. */
#ifndef TRIP_VIEW_LIGHT_H
#define TRIP_VIEW_LIGHT_H

#include <stdbool.h>
#include <stddef.h>

#include "triptych.h"

#ifdef __cplusplus
extern "C" {
#endif

/* In half diagonals of the data; from the farthest on the light is in a direction, nearer at a
 * place. */
#define TRIP_LIGHT_NEAREST 0.02
#define TRIP_LIGHT_FARTHEST 10.0

/* About the middle of the data. */
typedef struct trip_light_control {
    double round, up; /* degrees: from the x axis towards y, and towards z */
    double distance;
} trip_light_control;

/* Of a light that is not from the eye. */
trip_light_control trip_light_control_of(const triptych_settings *s, const triptych_info *info);
void trip_light_control_set(triptych_settings *s, const triptych_info *info,
                            const trip_light_control *control);

/* As an option of `triptych render`, with a space before it, to the last bit, for free(); "" where
 * it is from the eye or lights nothing; NULL without memory. */
char *trip_light_text(const triptych_settings *s);
/* The same of effects, with the data set of heat of what is shown, or NULL; "" where none runs. */
char *trip_effects_text(const triptych_settings *s, const char *heat);
/* In words, which end where the text does; "" where none runs. */
void trip_effects_say(const triptych_settings *s, const char *heat, char *text, size_t bytes);

/* ---- effects as controls ---- */

enum { TRIP_EFFECT_SWITCHES = 5, TRIP_EFFECT_NUMBERS = 5 };

typedef struct trip_effect_switch {
    int bit;                          /* of triptych_settings.effects */
    const char *name, *label, *words; /* as --effects has it, and for people */
} trip_effect_switch;

/* A number that counts while an effect is on. */
typedef struct trip_effect_number {
    int bits; /* of those that it is of, any of which will do */
    const char *name, *label, *unit;
    size_t at;  /* in triptych_settings */
    bool whole; /* an int there, not a double */
    double lo, hi, step;
} trip_effect_number;

extern const trip_effect_switch trip_effect_switches[TRIP_EFFECT_SWITCHES];
extern const trip_effect_number trip_effect_numbers[TRIP_EFFECT_NUMBERS];

/* What keeps it from running, in words; NULL: nothing. `heat` is the data set of that, or NULL. */
const char *trip_effect_lacks(const trip_effect_switch *effect, const triptych_settings *s,
                              const char *heat);
/* False, and nothing happens, where it lacks something. */
bool trip_effect_turn(const trip_effect_switch *effect, bool on, triptych_settings *s,
                      const char *heat);
/* Whether it stands below an effect's switch: each does below one, that of the first of its effects
 * which is on, or of the first. */
bool trip_effect_number_is_below(const trip_effect_number *number, const trip_effect_switch *effect,
                                 const triptych_settings *s);
double trip_effect_number_get(const trip_effect_number *number, const triptych_settings *s);
/* False, and nothing happens, where the number does not lie within its bounds or is not whole where
 * it should be. The colder and the hotter temperature move one another along. */
bool trip_effect_number_set(const trip_effect_number *number, double value, triptych_settings *s);

#ifdef __cplusplus
}
#endif

#endif
