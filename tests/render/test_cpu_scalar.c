/* Compares the short formula for a thin splat's opacity with its definition in double precision. */
#include "cpu/cpu_scalar.h"
#include "test.h"

#include <math.h>

enum { PLACES = 2000 };

static void terms(double depth, double c[TRIP_CPU_TERMS])
{
    for (int i = 0; i < TRIP_CPU_TERMS; i++) {
        c[i] = 0;
        for (int j = 0; j < 4; j++)
            c[i] += sqrt(depth) * (double)trip_cpu_thin[i][j] * pow(depth, j);
    }
}

static double short_opacity(const double c[TRIP_CPU_TERMS], double u)
{
    double s = 0;
    for (int i = 0; i < TRIP_CPU_TERMS; i++)
        s += c[i] * pow(u, i);
    return u * s * s;
}

static double opacity(double depth, double u)
{
    const double k2 = TRIP_CUTOFF * TRIP_CUTOFF;
    return -expm1(-depth * (exp(-k2 * (1 - u) / 2) - exp(-k2 / 2)));
}

static void short_opacities_have_the_stated_accuracy(void **state)
{
    (void)state;
    for (int n = 0; n <= 60; n++) {
        double depth = (double)TRIP_CPU_THIN * pow(2, -n / 3.0), c[TRIP_CPU_TERMS];
        double bound = depth <= 0.1 ? 1.5e-4 * depth : fmin(4e-4 * depth, 1.2e-4);
        terms(depth, c);
        for (int i = 0; i <= PLACES; i++) {
            double u = (double)i / PLACES;
            assert_true(fabs(short_opacity(c, u) - opacity(depth, u)) <= bound);
        }
    }
}

/* Integrates over u by Simpson's rule. */
static void short_opacities_have_the_integral_of_the_footprint(void **state)
{
    (void)state;
    for (int n = 0; n <= 60; n++) {
        double depth = (double)TRIP_CPU_THIN * pow(2, -n / 3.0), c[TRIP_CPU_TERMS];
        double is = 0, expected = 0;
        terms(depth, c);
        for (int i = 0; i <= PLACES; i++) {
            double u = (double)i / PLACES, weight = i == 0 || i == PLACES ? 1 : 2 + 2 * (i % 2);
            is += weight * short_opacity(c, u);
            expected += weight * opacity(depth, u);
        }
        assert_true(fabs(is - expected) <= 1e-6 * expected);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(short_opacities_have_the_stated_accuracy),
        cmocka_unit_test(short_opacities_have_the_integral_of_the_footprint),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
