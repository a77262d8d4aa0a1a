/* Finds, in a report of `triptych accuracy`, the fastest settings with a measured error of at most
 * a bound. One thread. */
#ifndef TRIP_ACCURACY_FASTEST_H
#define TRIP_ACCURACY_FASTEST_H

#include <stddef.h>
#include <stdint.h>

#include "setting.h"
#include "triptych_brick.h"

/* Bytes of triptych_info.checksum as text, with its terminating zero. */
enum { ACCURACY_CHECKSUM_BYTES = 17, ACCURACY_VERSION = 3 /* of accuracy.json */ };
void accuracy_checksum_text(uint64_t checksum, char text[ACCURACY_CHECKSUM_BYTES]);

typedef struct accuracy_wanted {
    double error;         /* bound for 99 % of the pixels in the worst view, of 255 */
    unsigned renderers;   /* allowed renderers as bits 1 << TRIPTYCH_RENDERER_...; 0 allows all */
    const char *function; /* argument of --tf; NULL means the transfer function in the data set */
    const char *checksum; /* of the data set, by accuracy_checksum_text(); NULL if unknown */
} accuracy_wanted;

typedef struct accuracy_found {
    accuracy_setting setting;
    double error, ms;
    char
        checksum[ACCURACY_CHECKSUM_BYTES]; /* of the measured data set; "" if the report has none */
    bool says_levels;                      /* whether the report gives levels_for */
    triptych_levels_for levels_for;        /* --levels-for of the measured data set */
} accuracy_found;

/* Reads a report, given as its folder or its accuracy.json. The caller sets
 * out->setting.settings to the settings that a report does not vary, such as light and
 * background; these settings are kept. Fails if the report is invalid or measured another data
 * set, or if the error of each setting exceeds the bound. Warns if the transfer function or the
 * light differs. */
int accuracy_fastest(const char *path, const accuracy_wanted *wanted, accuracy_found *out);
/* Reads the text of an accuracy.json; `path` is for messages. Otherwise like accuracy_fastest(). */
int accuracy_fastest_in(const char *text, const char *path, const accuracy_wanted *wanted,
                        accuracy_found *out);

/* Fails if the checksums of the measured and the drawn data set differ. `path` is for the
 * message. */
int accuracy_check_data(const char *measured, const char *drawn, const char *path);

/* Returns the default path of a report: NAME.accuracy beside NAME.trip, NAME.nrrd, and so on. The
 * caller frees it. NULL if memory is exhausted. */
char *accuracy_report_path(const char *data);

#endif
