/* Support for all tests. It includes cmocka with its headers, compares within a tolerance, gives a
 * repeatable random sequence, and catches reports instead of printing them. */
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

/* The difference may be `tolerance` times the larger magnitude, or times 1 if both are smaller. */
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

/* Returns the maximum difference. GCC 12 for 64-bit ARM fails with an internal error if fmax() is
 * used here. */
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

/* Returns numbers uniform in [0, 1), the same in every run. A 64-bit linear congruential generator
 * makes them. */
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

/* Begins to keep reports instead of printing them. */
static inline void test_catch_reports(void)
{
    test_report_count = 0;
    test_last_report[0] = 0;
    trip_report_redirect(test_catch, NULL);
}

/* Returns the number of reports since test_catch_reports(). Later reports are printed again. */
static inline int test_caught_reports(void)
{
    trip_report_redirect(NULL, NULL);
    return test_report_count;
}

/* Checks that there was exactly one report since test_catch_reports(), and that it contains `part`.
 * `part` must not be empty. */
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
