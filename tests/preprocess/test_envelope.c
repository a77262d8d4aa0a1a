#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <float.h>
#include <math.h>

#include "envelope.h"
#include "report.h"

static void silence(const char *line, void *user)
{
    (void)line;
    (void)user;
}

static void a_range_includes_both_ends_and_nothing_beyond(void **state)
{
    (void)state;
    trip_envelope e = { 0 };
    assert_int_equal(trip_envelope_add_range(&e, 0.1, 7), 0);
    /* 0.1 lies between two floats. The range excludes the lower float. */
    float above = (float)0.1 >= 0.1 ? (float)0.1 : nextafterf((float)0.1, 1);
    assert_true(trip_envelope_keeps(&e, above));
    assert_false(trip_envelope_keeps(&e, nextafterf(above, 0)));
    assert_true(trip_envelope_keeps(&e, 7));
    assert_false(trip_envelope_keeps(&e, nextafterf(7, 8)));
    trip_envelope_destroy(&e);
}

static void non_finite_values_are_never_kept(void **state)
{
    (void)state;
    trip_envelope e = { 0 };
    uint8_t keep[4];
    const float values[4] = { NAN, INFINITY, -INFINITY, FLT_MAX };
    assert_int_equal(trip_envelope_add_all(&e), 0);
    trip_envelope_keep_row(&e, values, 4, keep);
    for (int i = 0; i < 4; i++) {
        assert_int_equal(keep[i], i == 3);
        assert_int_equal(trip_envelope_keeps(&e, values[i]), i == 3);
    }
    trip_envelope_destroy(&e);
}

static void both_zeros_are_equal(void **state)
{
    (void)state;
    trip_envelope e = { 0 };
    assert_int_equal(trip_envelope_add_range(&e, 0, 0), 0);
    assert_true(trip_envelope_keeps(&e, 0.0f));
    assert_true(trip_envelope_keeps(&e, -0.0f));
    assert_false(trip_envelope_keeps(&e, FLT_TRUE_MIN));
    assert_false(trip_envelope_keeps(&e, -FLT_TRUE_MIN));
    trip_envelope_destroy(&e);
}

static void ranges_that_touch_become_one_interval(void **state)
{
    (void)state;
    trip_envelope e = { 0 };
    assert_int_equal(trip_envelope_add_range(&e, 5, 6), 0);
    assert_int_equal(trip_envelope_add_range(&e, 1, 2), 0);
    assert_int_equal(trip_envelope_add_range(&e, 8, 9), 0);
    assert_int_equal(e.count, 3);
    assert_int_equal(trip_envelope_add_range(&e, nextafterf(2, 3), nextafterf(5, 0)), 0);
    assert_int_equal(e.count, 2);
    assert_true(e.intervals[0].lo == 1 && e.intervals[0].hi == 6);
    assert_int_equal(trip_envelope_add_range(&e, 0, 10), 0);
    assert_int_equal(e.count, 1);
    trip_envelope_destroy(&e);
}

static void a_reversed_range_is_refused(void **state)
{
    (void)state;
    trip_envelope e = { 0 };
    trip_report_redirect(silence, NULL);
    assert_int_equal(trip_envelope_add_range(&e, 2, 1), TRIP_USAGE);
    assert_int_equal(trip_envelope_add_range(&e, NAN, 1), TRIP_USAGE);
    trip_report_redirect(NULL, NULL);
    trip_envelope_destroy(&e);
}

static uint32_t next_random(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)(*state >> 33);
}

static double random_value(uint64_t *random)
{
    static const double scales[] = { 1, 1e-3, 100, 1e6, 0x1p-140 };
    return (next_random(random) / 2147483648.0 - 0.5) * scales[next_random(random) % 5];
}

static int by_value(const void *a, const void *b)
{
    double x = ((const trip_tf_point *)a)->value, y = ((const trip_tf_point *)b)->value;
    return (x > y) - (x < y);
}

/* Makes a random transfer function. Many opacities are 0, some are the smallest positive double.
 * Values repeat. */
static trip_tf *random_function(uint64_t *random)
{
    trip_tf_point points[12] = { 0 };
    size_t count = 1 + next_random(random) % 12;
    trip_tf *tf;
    for (size_t i = 0; i < count; i++) {
        unsigned kind = next_random(random) % 4;
        points[i].value = random_value(random);
        if (kind == 1)
            points[i].value = (float)points[i].value;
        points[i].colour.opacity = kind < 2 ? 0 : kind == 2 ? 0.5 : DBL_TRUE_MIN;
        if (i && next_random(random) % 4 == 0)
            points[i].value = points[i - 1].value;
    }
    qsort(points, count, sizeof *points, by_value);
    assert_int_equal(trip_tf_from_points(&tf, points, count, false, 0), 0);
    return tf;
}

static void check_at(const trip_envelope *e, const trip_tf *tf, float value)
{
    bool shows = trip_tf_evaluate(tf, value).opacity > 0;
    if (trip_envelope_keeps(e, value) != shows)
        fail_msg("%a is %s, though its opacity is %a", (double)value, shows ? "left out" : "kept",
                 trip_tf_evaluate(tf, value).opacity);
}

static void a_transfer_function_keeps_exactly_the_visible_values(void **state)
{
    (void)state;
    uint64_t random = 1;
    for (int round = 0; round < 300; round++) {
        trip_tf *tf = random_function(&random);
        trip_envelope e = { 0 };
        size_t count;
        assert_int_equal(trip_envelope_add_tf(&e, tf), 0);
        const trip_tf_point *points = trip_tf_points(tf, &count);
        for (size_t i = 0; i < count; i++) {
            float near = (float)points[i].value;
            for (int step = 0; step < 4; step++, near = nextafterf(near, INFINITY))
                check_at(&e, tf, near);
            near = (float)points[i].value;
            for (int step = 0; step < 4; step++, near = nextafterf(near, -INFINITY))
                check_at(&e, tf, near);
        }
        for (int i = 0; i < 200; i++)
            check_at(&e, tf, (float)random_value(&random));
        check_at(&e, tf, FLT_MAX);
        check_at(&e, tf, -FLT_MAX);
        trip_tf_destroy(tf);
        trip_envelope_destroy(&e);
    }
}

static void rows_and_single_values_agree_for_any_intervals(void **state)
{
    (void)state;
    for (int intervals = 0; intervals < 12; intervals++) {
        trip_envelope e = { 0 };
        float values[100];
        uint8_t keep[100];
        for (int i = 0; i < intervals; i++)
            assert_int_equal(trip_envelope_add_range(&e, 8 * i, 8 * i + 3), 0);
        for (int i = 0; i < 100; i++)
            values[i] = (float)i;
        trip_envelope_keep_row(&e, values, 100, keep);
        for (int i = 0; i < 100; i++)
            assert_int_equal(keep[i], i / 8 < intervals && i % 8 <= 3);
        trip_envelope_destroy(&e);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_range_includes_both_ends_and_nothing_beyond),
        cmocka_unit_test(non_finite_values_are_never_kept),
        cmocka_unit_test(both_zeros_are_equal),
        cmocka_unit_test(ranges_that_touch_become_one_interval),
        cmocka_unit_test(a_reversed_range_is_refused),
        cmocka_unit_test(a_transfer_function_keeps_exactly_the_visible_values),
        cmocka_unit_test(rows_and_single_values_agree_for_any_intervals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
