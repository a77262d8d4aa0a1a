/* From a report of `triptych accuracy`: the fastest settings that were measured to stay below an
 * error. One thread. */
#ifndef TRIP_ACCURACY_FASTEST_H
#define TRIP_ACCURACY_FASTEST_H

#include <stddef.h>
#include <stdint.h>

#include "setting.h"
#include "triptych_brick.h"

/* triptych_info.checksum as reports have it. */
enum { ACCURACY_CHECKSUM_BYTES = 17 };
void accuracy_checksum_text(uint64_t checksum, char text[ACCURACY_CHECKSUM_BYTES]);

typedef struct accuracy_wanted {
    double error;         /* of 255: the 99th percentile of the view where that is largest */
    unsigned renderers;   /* of which: bits 1 << TRIPTYCH_RENDERER_...; 0: any */
    const char *function; /* that is drawn with, as of --tf; NULL: the data set's own */
    const char *checksum; /* of the data set, accuracy_checksum_text(); NULL: not known */
} accuracy_wanted;

typedef struct accuracy_found {
    accuracy_setting setting;
    double error, ms;
    char checksum[ACCURACY_CHECKSUM_BYTES]; /* of the report's data set; "": it names none */
    bool says_levels;                       /* whether the report says which that */
    triptych_levels_for levels_for;         /* was bricked with */
} accuracy_found;

/* `path` is a report's folder or its accuracy.json. out->setting.settings has what the report says
 * nothing of (light, background, ...) before and after. Fails where the report is none or of
 * another data set, or nothing in it stays below the error; warns where it is of another function
 * or light. */
int accuracy_fastest(const char *path, const accuracy_wanted *wanted, accuracy_found *out);
/* The same of the text of an accuracy.json; `path` is for messages. */
int accuracy_fastest_in(const char *text, const char *path, const accuracy_wanted *wanted,
                        accuracy_found *out);

/* Fails where the checksums of the data set measured and of the one drawn differ; `path` is for the
 * message. */
int accuracy_check_data(const char *measured, const char *drawn, const char *path);

/* Where the report of a data set or volume lies: NAME.accuracy beside NAME.trip, NAME.nrrd, ...;
 * for free(), NULL without memory. */
char *accuracy_report_path(const char *data);

#endif
