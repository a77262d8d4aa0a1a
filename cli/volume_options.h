/* Options that say how a volume is read, which `brick` and `render` share. Each reports a bad
 * value, naming the option, and returns TRIP_USAGE. Main thread only. */
#ifndef TRIP_CLI_VOLUME_OPTIONS_H
#define TRIP_CLI_VOLUME_OPTIONS_H

#include "triptych_brick.h"

/* A grid's name; a second one is refused. */
int trip_option_grid(const char *name, const char **grid);
/* "filled" or "band". */
int trip_option_level_set(const char *text, triptych_level_set *mode);
/* "X,Y,Z", each above 0. */
int trip_option_spacing(const char *text, double spacing[3]);
/* "PIR". */
int trip_option_axes(const char *text, const char **axes);
/* Refuses what these say where the input is a data set, which has it fixed. */
int trip_option_check_volume(const triptych_brick_options *v, const char *input);

#endif
