/* --quality, --error and --report select the compromise between accuracy and time, for all commands
 * that draw. Main thread only. */
#ifndef TRIP_QUALITY_OPTIONS_H
#define TRIP_QUALITY_OPTIONS_H

#include <stdbool.h>

#include "fastest.h"
#include "triptych.h"

typedef struct quality_options {
    bool given; /* --quality was given */
    triptych_quality quality;
    double error;       /* 0 if --error was not given */
    const char *report; /* NULL selects NAME.accuracy beside the data */
    /* Name of a given option that a report also measures, such as "classify", or NULL. */
    const char *measurable;
    /* Set by quality_options_use(): checksum of the data set that the report measured. It is "" if
     * the report gives none, or if the input is a data set. */
    char measured[ACCURACY_CHECKSUM_BYTES];
    bool says_levels; /* whether the report gives levels_for, the --levels-for of its data set */
    triptych_levels_for levels_for;
} quality_options;

/* Requires the keys KEY_QUALITY, KEY_ERROR and KEY_REPORT. */
#define TRIP_OPTIONS_QUALITY(group)                                                                \
    { "quality",                                                                                   \
      KEY_QUALITY,                                                                                 \
      "NAME",                                                                                      \
      0,                                                                                           \
      "Selects how close the picture comes to the exact integral: draft, normal, high or exact; "  \
      "closer takes longer (default: normal)",                                                     \
      group },                                                                                     \
        { "error",                                                                                 \
          KEY_ERROR,                                                                               \
          "E",                                                                                     \
          0,                                                                                       \
          "Selects the fastest settings that keep 99 % of the pixels within E of 255, as "         \
          "`triptych accuracy` measured for this data; excludes --quality",                        \
          group },                                                                                 \
    {                                                                                              \
        "report", KEY_REPORT, "REPORT/", 0,                                                        \
            "Names the report that --error reads (default: NAME.accuracy beside the data)", group  \
    }

int quality_option_quality(const char *text, quality_options *q);
int quality_option_error(const char *text, quality_options *q);
/* Checks, after parsing, for options that exclude each other. */
int quality_options_check(const quality_options *q);
static inline bool quality_options_given(const quality_options *q)
{
    return q->given || q->error > 0;
}

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

/* Applies the options to *s. --error also selects the renderer if it is auto, and prints the
 * selected settings. `slow_too` allows it to select the reference and integral renderers. */
int quality_options_use(quality_options *q, const quality_drawn *drawn, triptych_settings *s,
                        triptych_renderer *renderer, bool slow_too);

#endif
