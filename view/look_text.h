/* Writes settings as options of `triptych render` that reproduce the picture; light.h does it for
 * light and effects. Any thread may call these functions. */
#ifndef TRIP_VIEW_LOOK_TEXT_H
#define TRIP_VIEW_LOOK_TEXT_H

#include "triptych.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Returns the options that differ from the default, each after a space, for free(). Numbers are
 * exact to the last bit. The transfer function's name is quoted for a shell; NULL means the data
 * set's default. Returns NULL if memory is exhausted. */
char *trip_look_text(const triptych_settings *s, const char *function, double opacity_scale);

#ifdef __cplusplus
}
#endif

#endif
