/* How much pixels jump while the camera turns through the change of the dominant axis, by each
 * method and h, with values and with splats: bench_popping.h has the figures. One thread. */
#ifndef TRIP_ACCURACY_POPPING_H
#define TRIP_ACCURACY_POPPING_H

#include "bench_popping.h"
#include "bench_progress.h"
#include "contexts.h"
#include "setting.h"

/* Merged by each h, clip and axis; not `image`, which the cpu renderer has not. */
enum { ACCURACY_POPPINGS = 2, ACCURACY_POPPING_ROWS = BENCH_POPPING_SETTINGS - 1 };

typedef struct accuracy_popping {
    const char *name; /* as of a setting */
    triptych_classify classify;
    accuracy_state state;
    char why[256]; /* it was left out */
    bench_popping_row rows[ACCURACY_POPPING_ROWS];
} accuracy_popping;

/* By post and by pre, nothing measured yet. */
extern const accuracy_popping accuracy_poppings[ACCURACY_POPPINGS];

/* Of the first data set by the cpu renderer, whose context is open and whose view is lost; `usual`
 * has what the settings have in common. `rgba`: room for a picture. */
int accuracy_popping_measure(accuracy_popping *p, accuracy_contexts *contexts,
                             const triptych_settings *defaults, bench_progress *progress,
                             float *rgba);

#endif
