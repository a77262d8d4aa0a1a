/* What tests share: cmocka with its headers, comparing within a tolerance, a
 * repeatable random sequence, and catching reports instead of printing them. */
#ifndef TEST_H
#define TEST_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "report.h"
#include "sanitizers.h"
#include "skips.h"

/* Within `tolerance` of the larger magnitude, or of 1 where both are smaller. */
#define assert_close(actual, expected, tolerance)                                                  \
    test_close((actual), (expected), (tolerance), #actual, __FILE__, __LINE__)

static inline void test_close(double actual, double expected, double tolerance, const char *name,
                              const char *file, int line)
{
    double scale = fmax(1, fmax(fabs(actual), fabs(expected)));
    if (fabs(actual - expected) <= tolerance * scale)
        return;
    print_error("%s is %.17g, expected %.17g within %g\n", name, actual, expected, tolerance);
    _fail(file, line);
}

/* The largest difference. Not by fmax(), on which GCC 12 for 64-bit ARM fails with an internal
 * error here. */
static inline double test_max_apart(const float *a, const float *b, size_t count)
{
    double max = 0;
    for (size_t i = 0; i < count; i++) {
        double apart = fabs((double)a[i] - (double)b[i]);
        if (!(apart <= max))
            max = apart;
    }
    return max;
}

/* Uniform in [0, 1), the same sequence in every run (a 64-bit linear congruential generator). */
static inline double test_random(void)
{
    static uint64_t seed = 1;
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) * 0x1p-53;
}

static int test_report_count;
static char test_last_report[4200];

static inline void test_catch(const char *line, void *user)
{
    (void)user;
    test_report_count++;
    snprintf(test_last_report, sizeof test_last_report, "%s", line);
}

/* Reports are kept from here on instead of printed. */
static inline void test_catch_reports(void)
{
    test_report_count = 0;
    test_last_report[0] = 0;
    trip_report_redirect(test_catch, NULL);
}

/* How many reports there were since test_catch_reports(); further ones are printed. */
static inline int test_caught_reports(void)
{
    trip_report_redirect(NULL, NULL);
    return test_report_count;
}

/* Exactly one report since test_catch_reports(), with `part` in it, which names the message. */
#define assert_one_report(part) test_one_report((part), __FILE__, __LINE__)

static inline void test_one_report(const char *part, const char *file, int line)
{
    int count = test_caught_reports();
    if (count == 1 && *part && strstr(test_last_report, part))
        return;
    print_error("%d reports, expected one with `%s`; the last: %s\n", count, part,
                test_last_report);
    _fail(file, line);
}

#endif
