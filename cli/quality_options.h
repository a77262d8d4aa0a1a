/* --quality, --error and --report: what accuracy is traded for time by, in one word or one number,
 * for all commands that draw. Main thread only. */
#ifndef TRIP_QUALITY_OPTIONS_H
#define TRIP_QUALITY_OPTIONS_H

#include <stdbool.h>

#include "fastest.h"
#include "triptych.h"

typedef struct quality_options {
    bool given; /* a quality */
    triptych_quality quality;
    double error;       /* 0: not given */
    const char *report; /* NULL: NAME.accuracy beside the data */
    /* An option that was given of those that a report has measured, "classify"; NULL: none. */
    const char *measurable;
    /* Once used for a volume: the data set that the report is of; "": not known, or no volume. */
    char measured[ACCURACY_CHECKSUM_BYTES];
    bool says_levels; /* the report, what that was bricked with: */
    triptych_levels_for levels_for;
} quality_options;

/* The keys are KEY_QUALITY, KEY_ERROR and KEY_REPORT. */
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
/* What excludes one another; after parsing. */
int quality_options_check(const quality_options *q);
static inline bool quality_options_given(const quality_options *q)
{
    return q->given || q->error > 0;
}

/* What is drawn: a data set or volume, and the function as of --tf or NULL. */
typedef struct quality_drawn {
    const char *input, *function;
} quality_drawn;

/* Of a volume, once its data set is open: fails where `measured` is another, and not "". */
int quality_options_check_data(const char *measured, triptych *t, const char *volume);

/* The coarse levels that a volume is bricked with for settings once chosen: the measured data
 * set's; where there is none, both kinds if splats are to be drawn by coarse ones. */
triptych_levels_for quality_options_levels(const quality_options *q, bool coarse_splats);

/* Changes settings as the options say, and with --error the renderer where it is auto. Prints what
 * --error has chosen. */
int quality_options_use(quality_options *q, const quality_drawn *drawn, triptych_settings *s,
                        triptych_renderer *renderer, bool slow_too);

#endif
