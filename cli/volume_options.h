/* Options for reading a volume, shared by the commands. Each function reports a bad value, naming
 * the option, and returns TRIP_USAGE. Main thread only. */
#ifndef TRIP_CLI_VOLUME_OPTIONS_H
#define TRIP_CLI_VOLUME_OPTIONS_H

#include "triptych_brick.h"

/* Sets the name of a grid; refuses a second one. */
int trip_option_grid(const char *name, const char **grid);
/* Parses "filled" or "band". */
int trip_option_level_set(const char *text, triptych_level_set *mode);
/* Parses "X,Y,Z", each above 0. */
int trip_option_spacing(const char *text, double spacing[3]);
/* Checks axes such as "PIR". */
int trip_option_axes(const char *text, const char **axes);
/* Refuses these options for a data set, which has its values fixed. */
int trip_option_check_volume(const triptych_brick_options *v, const char *input);

#endif
