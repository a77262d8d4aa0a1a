/* How a data set is coloured and drawn, but for light and effects (light.h), as options of
 * `triptych render` that give the same picture again. Any thread. */
#ifndef TRIP_VIEW_LOOK_TEXT_H
#define TRIP_VIEW_LOOK_TEXT_H

#include "triptych.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What differs from the default: a space and an option each, numbers to the last bit, a function's
 * name or path as one word of a shell. `function` is NULL for the data set's own. For free(); NULL
 * without memory. */
char *trip_look_text(const triptych_settings *s, const char *function, double opacity_scale);

#ifdef __cplusplus
}
#endif

#endif
