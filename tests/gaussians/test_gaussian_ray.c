/* The integral of densities along a ray, against closed forms and a fine quadrature. */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <setjmp.h>

#include <cmocka.h>

#include "gaussian_ray.h"

enum { PARTS_MAX = 24, STEPS = 200000 };

#define TOLERANCE 5e-5

static void integrate(const trip_ray_part *parts, size_t count, double from, double rgba[4])
{
    trip_normal_table table;
    void *memory = calloc(1, trip_ray_scratch_bytes(PARTS_MAX));
    assert_non_null(memory);
    trip_ray_scratch s = trip_ray_scratch_in(memory, PARTS_MAX);
    trip_normal_table_make(&table);
    for (size_t i = 0; i < count; i++)
        s.parts[i] = parts[i];
    trip_ray_integrate(&table, &s, count, from, TOLERANCE, rgba);
    free(memory);
}

static double alpha_of(const trip_ray_part *p)
{
    return 1 - exp(-p->tau);
}

static void expect(const double found[4], const double wanted[4], double within)
{
    for (int c = 0; c < 4; c++)
        assert_true(fabs(found[c] - wanted[c]) <= within);
}

static void the_table_has_the_normal_integral(void **state)
{
    trip_normal_table t;
    (void)state;
    trip_normal_table_make(&t);
    for (double x = -7; x <= 7; x += 0.00137)
        assert_true(fabs(trip_normal_integral(&t, x) - 0.5 * erfc(-x / sqrt(2))) < 5e-8);
}

static void nothing_is_transparent(void **state)
{
    double rgba[4];
    (void)state;
    integrate(NULL, 0, 0, rgba);
    expect(rgba, (double[4]){ 0 }, 0);
}

static void one_density_has_its_opacity_and_colour(void **state)
{
    (void)state;
    const double deviations[] = { 0, 1e-6, 0.3, 10 };
    for (int i = 0; i < 4; i++) {
        const trip_ray_part p = { 2, deviations[i], 1.7, { 0.9, 0.2, 0.5 } };
        const double a = alpha_of(&p);
        double rgba[4];
        integrate(&p, 1, 0, rgba);
        expect(rgba, (double[4]){ 0.9 * a, 0.2 * a, 0.5 * a, a }, 1e-12);
    }
}

static void densities_apart_lie_over_one_another(void **state)
{
    (void)state;
    const trip_ray_part parts[] = { { 5, 0.1, 1, { 0, 1, 0 } },
                                    { 3, 0.1, 0.7, { 1, 0, 0 } },
                                    { 9, 0, 2, { 0, 0, 1 } } };
    const double g = alpha_of(&parts[0]), r = alpha_of(&parts[1]), b = alpha_of(&parts[2]);
    double rgba[4];
    integrate(parts, 3, 0, rgba);
    expect(rgba,
           (double[4]){ r, (1 - r) * g, (1 - r) * (1 - g) * b, 1 - (1 - r) * (1 - g) * (1 - b) },
           TOLERANCE);
}

static void equal_densities_mix_by_their_optical_depths(void **state)
{
    (void)state;
    for (int flat = 0; flat < 2; flat++) {
        const trip_ray_part parts[] = { { 3, flat ? 0 : 0.2, 1.5, { 1, 0, 0 } },
                                        { 3, flat ? 0 : 0.2, 0.5, { 0, 1, 0 } } };
        const double a = 1 - exp(-2.0);
        double rgba[4];
        integrate(parts, 2, 0, rgba);
        expect(rgba, (double[4]){ 0.75 * a, 0.25 * a, 0, a }, TOLERANCE);
    }
}

static void what_lies_behind_the_eye_is_mixed_at_the_eye(void **state)
{
    (void)state;
    const trip_ray_part parts[] = { { -1, 0.1, 1, { 1, 0, 0 } },
                                    { -3, 0.1, 1, { 0, 1, 0 } },
                                    { 2, 0.1, 1, { 0, 0, 1 } } };
    const double a = 1 - exp(-2.0), b = exp(-2.0) * (1 - exp(-1.0));
    double rgba[4];
    integrate(parts, 3, 0, rgba);
    expect(rgba, (double[4]){ 0.5 * a, 0.5 * a, b, a + b }, TOLERANCE);
}

static double some(void)
{
    return rand() / (double)RAND_MAX; /* NOLINT: tests need no strong numbers */
}

/* Takes the mixture as constant in each of many equal steps, which is exact in the limit. */
static void step_through(const trip_ray_part *parts, size_t count, double end, double rgba[4])
{
    double t = 1, before[PARTS_MAX];
    for (size_t i = 0; i < count; i++)
        before[i] = 0;
    for (int c = 0; c < 4; c++)
        rgba[c] = 0;
    for (int n = 1; n <= STEPS; n++) {
        double tau = 0, rgb[3] = { 0 };
        for (size_t i = 0; i < count; i++) {
            const trip_ray_part *p = &parts[i];
            const double x = (end * n / STEPS - p->mean) / p->deviation;
            const double after = fabs(x) > 9 ? x > 0 : 0.5 * erfc(-x / sqrt(2));
            tau += p->tau * (after - before[i]);
            for (int c = 0; c < 3; c++)
                rgb[c] += p->tau * (after - before[i]) * p->rgb[c];
            before[i] = after;
        }
        for (int c = 0; c < 3 && tau > 0; c++)
            rgba[c] += t * (1 - exp(-tau)) * rgb[c] / tau;
        t *= exp(-tau);
    }
    rgba[3] = 1 - t;
}

/* Deviations from 0.0003 to 1. Several thin densities in wide ones, at both ends of an interval,
 * must not look like a mixture. */
static void a_fine_quadrature_finds_the_same(void **state)
{
    (void)state;
    srand(7);
    for (int round = 0; round < 24; round++) {
        trip_ray_part parts[PARTS_MAX];
        const size_t count = 2 + (size_t)(some() * (PARTS_MAX - 2));
        double found[4], wanted[4];
        for (size_t i = 0; i < count; i++)
            parts[i] = (trip_ray_part){ .mean = 2 + some() * (round % 2 ? 1 : 0.1),
                                        .deviation = fmax(0.0003, exp(-9 * some())),
                                        .tau = 4.6 * pow(some(), 3),
                                        .rgb = { some(), some(), some() } };
        integrate(parts, count, 0, found);
        step_through(parts, count, 8, wanted);
        expect(found, wanted, 2e-4); /* 0.05 of 255 */
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_table_has_the_normal_integral),
        cmocka_unit_test(nothing_is_transparent),
        cmocka_unit_test(one_density_has_its_opacity_and_colour),
        cmocka_unit_test(densities_apart_lie_over_one_another),
        cmocka_unit_test(equal_densities_mix_by_their_optical_depths),
        cmocka_unit_test(what_lies_behind_the_eye_is_mixed_at_the_eye),
        cmocka_unit_test(a_fine_quadrature_finds_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
