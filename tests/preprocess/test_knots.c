/* Codes that follow the values. Any window that holds 1 % of the sorted values has at least 64
 * codes. A value differs from the value of its code by at most half a step. */
#include "brick_files.h"

#include <math.h>

#include "codes.h"
#include "knots.h"

enum { COUNT = 20000, CONTRACT_CODES = 64 };

static int compare(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static double uniform(uint64_t *random)
{
    return (double)(test_random(random) % 1000000 + 1) / 1000001;
}

static double normal(uint64_t *random)
{
    const double u = uniform(random);
    return sqrt(-2 * log(u)) * cos(2 * 3.14159265358979323846 * uniform(random));
}

/* Sorts the values and checks the contract. */
static void check(float *values)
{
    static trip_knots knots;
    qsort(values, COUNT, sizeof *values, compare);
    const double least = (double)values[0], most = (double)values[COUNT - 1];
    const double lo = (double)values[COUNT / 1000], hi = (double)values[COUNT - COUNT / 1000];
    trip_knots_make(&knots, &(trip_knots_params){ .kept = values,
                                                  .all = values,
                                                  .kept_count = COUNT,
                                                  .all_count = COUNT,
                                                  .lo = fmin(least, lo - (hi - lo) / 4),
                                                  .hi = fmax(most, hi + (hi - lo) / 4),
                                                  .likely_lo = lo - (hi - lo) / 4,
                                                  .likely_hi = hi + (hi - lo) / 4 });
    assert_null(trip_codes_fault(knots.values, TRIP_KNOTS, TRIP_KNOT_STEP_LOG2));
    const trip_codes codes = trip_codes_from_table(knots.values, TRIP_KNOTS, TRIP_KNOT_STEP_LOG2);
    for (int i = 0; i + COUNT / 100 < COUNT; i++) {
        const double from = (double)values[i], to = (double)values[i + COUNT / 100];
        if (from < to)
            assert_true(trip_codes_code(&codes, to) - trip_codes_code(&codes, from) >=
                        CONTRACT_CODES);
    }
    for (int i = 0; i < COUNT; i++) {
        const double value = (double)values[i];
        const unsigned code = trip_knots_code(&knots, value);
        const double here = trip_codes_value(&codes, code);
        const double below = code > 0 ? trip_codes_value(&codes, code - 1) : here;
        const double above = code < 65535 ? trip_codes_value(&codes, code + 1) : here;
        const double half = (value < here ? here - below : above - here) / 2;
        assert_true(fabs(value - here) <= half * (1 + 1e-9) + 1e-12 * fabs(value));
        assert_int_equal(trip_codes_nearest(&codes, value), code);
    }
    assert_int_equal(trip_knots_code(&knots, NAN), 0);
    assert_int_equal(trip_knots_code(&knots, -INFINITY), 0);
    assert_int_equal(trip_knots_code(&knots, INFINITY), 65535);
}

static void a_hot_voxel_leaves_the_codes(void **state)
{
    (void)state;
    static float values[COUNT];
    uint64_t random = 1;
    for (int i = 0; i < COUNT; i++)
        values[i] = (float)(20 + 5 * normal(&random) + (i % 2 ? 800 * uniform(&random) : 0));
    values[7] = 1e6f;
    check(values);
    values[7] = 1e20f;
    check(values);
}

static void decades_get_codes_everywhere(void **state)
{
    (void)state;
    static float values[COUNT];
    for (int decades = 1; decades <= 30; decades += 7) {
        uint64_t random = 2;
        for (int i = 0; i < COUNT; i++)
            values[i] = (float)pow(10, decades * uniform(&random));
        check(values);
        for (int i = 0; i < COUNT; i++) /* on both sides of zero */
            values[i] *= i % 2 ? -1 : 1;
        check(values);
    }
}

static void long_tails_get_codes_everywhere(void **state)
{
    (void)state;
    static float values[COUNT];
    uint64_t random = 3;
    for (int i = 0; i < COUNT; i++)
        values[i] = (float)exp(3 * normal(&random));
    check(values);
    for (int i = 0; i < COUNT; i++)
        values[i] = (float)(1 / uniform(&random));
    check(values);
}

static void a_dense_cluster_far_from_zero_gets_codes(void **state)
{
    (void)state;
    static float values[COUNT];
    uint64_t random = 4;
    for (int i = 0; i < COUNT; i++)
        values[i] = (float)(1e6 + normal(&random));
    values[1] = -1e9f;
    values[2] = 5e8f;
    values[3] = 0;
    check(values);
}

/* Most voxels have one value. */
static void a_background_takes_no_codes_from_the_others(void **state)
{
    (void)state;
    static float values[COUNT];
    uint64_t random = 5;
    for (int i = 0; i < COUNT; i++)
        values[i] = i % 20 ? 0 : (float)exp(8 * uniform(&random));
    check(values);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_hot_voxel_leaves_the_codes),
        cmocka_unit_test(decades_get_codes_everywhere),
        cmocka_unit_test(long_tails_get_codes_everywhere),
        cmocka_unit_test(a_dense_cluster_far_from_zero_gets_codes),
        cmocka_unit_test(a_background_takes_no_codes_from_the_others),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
