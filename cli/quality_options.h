/* --error and --report select settings by measured accuracy, for all commands that draw. Main
 * thread only. */
#ifndef TRIP_QUALITY_OPTIONS_H
#define TRIP_QUALITY_OPTIONS_H

#include <stdbool.h>

#include "fastest.h"
#include "draw_settings.h"
#include "triptych_brick.h"

typedef struct quality_options {
    double error;       /* 0 if --error was not given */
    const char *report; /* NULL selects NAME.accuracy beside the data */
    /* Set by quality_options_use(): checksum of the data set that the report measured. It is "" if
     * the report gives none, or if the input is a data set. */
    char measured[ACCURACY_CHECKSUM_BYTES];
    bool says_levels; /* whether the report gives levels_for, the --levels-for of its data set */
    triptych_levels_for levels_for;
} quality_options;

extern const trip_option_table quality_table; /* quality_options */

/* Checks, after parsing, for options that exclude each other. */
int quality_options_check(const quality_options *q, const draw_settings *given,
                          triptych_renderer renderer);

/* The data set or volume to draw, and the argument of --tf or NULL. */
typedef struct quality_drawn {
    const char *input, *function;
} quality_drawn;

/* Compares the open data set of a volume to the checksum `measured`. Fails if they differ; ""
 * matches every data set. */
int quality_options_check_data(const char *measured, triptych *t, const char *volume);

/* Returns the levels-for option for bricking a volume. The measured data set's option is used if it
 * is known. Otherwise both kinds are made if coarse levels are drawn as splats. */
triptych_levels_for quality_options_levels(const quality_options *q, bool coarse_splats);

/* Takes the settings of --error from its report: every setting that a report measures, and the
 * renderer if it is auto. Prints them. `slow_too` allows the reference and integral renderers. */
int quality_options_use(quality_options *q, const quality_drawn *drawn, draw_settings *s,
                        triptych_renderer *renderer, bool slow_too);

#endif
