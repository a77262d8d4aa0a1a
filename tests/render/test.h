/* What the tests of this folder share: cmocka with its headers, comparing within a tolerance, a
 * repeatable random sequence, and counting reports instead of printing them. */
#ifndef TEST_H
#define TEST_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "report.h"

/* Within `tolerance` of the larger magnitude, or of 1 where both are smaller. */
#define assert_close(actual, expected, tolerance)                                                  \
    test_close((actual), (expected), (tolerance), #actual, __FILE__, __LINE__)

static inline void test_close(double actual, double expected, double tolerance, const char *what,
                              const char *file, int line)
{
    double scale = fmax(1, fmax(fabs(actual), fabs(expected)));
    if (fabs(actual - expected) <= tolerance * scale)
        return;
    print_error("%s is %.17g, expected %.17g within %g\n", what, actual, expected, tolerance);
    _fail(file, line);
}

/* Uniform in [0, 1), the same sequence in every run (a 64-bit linear congruential generator). */
static inline double test_random(void)
{
    static uint64_t seed = 1;
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) * 0x1p-53;
}

static int test_report_count;

static inline void test_count_report(const char *line, void *user)
{
    (void)line;
    (void)user;
    test_report_count++;
}

/* Reports are counted from here on instead of printed. */
static inline void test_expect_report(void)
{
    test_report_count = 0;
    trip_report_redirect(test_count_report, NULL);
}

/* How many there were; further ones are printed again. */
static inline int test_reports(void)
{
    trip_report_redirect(NULL, NULL);
    return test_report_count;
}

#endif
