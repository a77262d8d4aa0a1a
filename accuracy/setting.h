/* The settings that trade accuracy for time. Each has a name, a renderer, the settings of
 * triptych.h, and the options of `triptych render` that draw the same picture. Pure functions. */
#ifndef TRIP_ACCURACY_SETTING_H
#define TRIP_ACCURACY_SETTING_H

#include <stdbool.h>

#include "draw_settings.h"

enum { ACCURACY_NAME_BYTES = 48, ACCURACY_SETTINGS_MAX = 96, ACCURACY_OPTIONS_MAX = 14 };
enum { ACCURACY_RAYS_MAX = 4 }; /* along each side of a pixel */

typedef struct accuracy_setting {
    char name[ACCURACY_NAME_BYTES];
    triptych_renderer renderer;
    draw_settings settings;
} accuracy_setting;

/* State of a setting that was selected. */
typedef enum accuracy_state {
    ACCURACY_NOT_REACHED, /* --budget was used up before */
    ACCURACY_MEASURED,
    ACCURACY_LEFT_OUT,
} accuracy_state;

/* Lists all settings, the most important first. `defaults` has the settings that all share, such as
 * shading and background. Returns their number. */
int accuracy_settings(accuracy_setting out[ACCURACY_SETTINGS_MAX], const draw_settings *defaults);

/* Returns settings that choose nothing by the view: one ray per pixel, the finest level, and with
 * post 4 samples per sheet. */
draw_settings accuracy_setting_fixed(const draw_settings *defaults, triptych_classify classify);

/* Returns the mean error that the quality of a setting promises, of 255; 0 if it promises none. */
double accuracy_setting_promise(const accuracy_setting *s);

/* Returns whether the reference renderer draws the same picture for both settings. */
bool accuracy_setting_same_reference(const draw_settings *a, const draw_settings *b);

typedef struct accuracy_option {
    const char *name; /* without dashes, such as "classify" */
    char value[32];
} accuracy_option;

/* Converts a setting to options of `triptych render`. Returns their number. */
int accuracy_setting_options(const accuracy_setting *s, accuracy_option out[ACCURACY_OPTIONS_MAX]);
/* Sets an option from its name and value, such as "classify" and "post". Returns false if either is
 * unknown. */
bool accuracy_setting_read_option(accuracy_setting *s, const char *name, const char *value);

#endif
