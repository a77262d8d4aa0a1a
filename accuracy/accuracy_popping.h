/* Measures popping: the jump of pixels while the camera turns through the change of the dominant
 * axis. It is measured for each method and h, with post and with pre. popping.h defines the
 * figures. One thread. */
#ifndef TRIP_ACCURACY_POPPING_H
#define TRIP_ACCURACY_POPPING_H

#include "contexts.h"
#include "popping.h"
#include "progress_line.h"
#include "setting.h"

/* merge with each h, clip and axis; the cpu renderer lacks the method image */
enum { ACCURACY_POPPINGS = 2, ACCURACY_POPPING_ROWS = MEASURE_POPPING_SETTINGS - 1 };

typedef struct accuracy_popping {
    const char *name; /* name of the setting in --settings */
    triptych_classify classify;
    accuracy_state state;
    char why[256]; /* reason if it was left out */
    cJSON *rows;   /* of measure_popping_all(), for cJSON_Delete(); NULL if it was not measured */
} accuracy_popping;

/* One entry for post and one for pre, without measurements. */
extern const accuracy_popping accuracy_poppings[ACCURACY_POPPINGS];

/* Measures popping on the first data set by the cpu renderer. Its context is open, and its view
 * changes. `defaults` has the settings that all share. `rgba` has room for one picture.
 * Adds the steps of progress that began to *begun. */
int accuracy_popping_measure(accuracy_popping *p, accuracy_contexts *contexts,
                             const draw_settings *defaults, measure_progress *progress, float *rgba,
                             int *begun);

#endif
