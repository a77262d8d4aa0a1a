/* The light as controls have it: two angles and how far it is, about the middle of the data; and
 * the light and effects as options and in words. Plain values. */
#ifndef TRIP_VIEW_LIGHT_H
#define TRIP_VIEW_LIGHT_H

#include <stddef.h>

#include "triptych.h"

#ifdef __cplusplus
extern "C" {
#endif

/* In half diagonals of the data; from the farthest on the light is in a direction, nearer at a
 * place. */
#define TRIP_LIGHT_NEAREST 0.02
#define TRIP_LIGHT_FARTHEST 10.0

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

#ifdef __cplusplus
}
#endif

#endif
