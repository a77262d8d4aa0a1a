/* What is swept: each setting that trades accuracy for time, as a name, a renderer and the settings
 * of triptych.h, and the options of `triptych render` that draw the same. Pure functions. */
#ifndef TRIP_ACCURACY_SETTING_H
#define TRIP_ACCURACY_SETTING_H

#include <stdbool.h>

#include "triptych.h"

enum { ACCURACY_NAME_BYTES = 48, ACCURACY_SETTINGS_MAX = 96, ACCURACY_OPTIONS_MAX = 14 };

typedef struct accuracy_setting {
    char name[ACCURACY_NAME_BYTES];
    triptych_renderer renderer;
    triptych_settings settings;
} accuracy_setting;

/* What became of one that was wanted. */
typedef enum accuracy_state {
    ACCURACY_NOT_REACHED, /* the seconds were over */
    ACCURACY_MEASURED,
    ACCURACY_LEFT_OUT,
} accuracy_state;

/* All of them, those first that matter most; `usual` has what they have in common (shading,
 * background). Returns how many. */
int accuracy_settings(accuracy_setting out[ACCURACY_SETTINGS_MAX],
                      const triptych_settings *defaults);

/* Whether a picture of the reference is the same for both. */
bool accuracy_setting_same_reference(const triptych_settings *a, const triptych_settings *b);

typedef struct accuracy_option {
    const char *name; /* "classify", without dashes */
    char value[32];
} accuracy_option;

/* The options of `triptych render`; returns how many. */
int accuracy_setting_options(const accuracy_setting *s, accuracy_option out[ACCURACY_OPTIONS_MAX]);
/* Sets what one of them says, "classify" "post"; false: there is no such option or value. */
bool accuracy_setting_read_option(accuracy_setting *s, const char *name, const char *value);

#endif
