#include "histograms.h"

static trip_tf *labels(void)
{
    trip_tf *tf;
    assert_int_equal(trip_tf_labels_from_histogram(&tf, &h), TRIP_OK);
    return tf;
}

/* The numbers are so large that neighbouring doubles are more than 1 apart. */
static void numbers_too_large_for_integers_are_no_labels(void **state)
{
    (void)state;
    start(1e17, 1e17 + 1024);
    for (int i = 0; i <= 1024; i += 16)
        put(1e17 + i, 100);
    trip_tf *tf = labels(), *defaults;
    assert_int_equal(trip_tf_from_histogram(&defaults, &h), TRIP_OK);
    assert_true(trip_tf_evaluate(tf, 1e17).opacity == trip_tf_evaluate(defaults, 1e17).opacity);
    trip_tf_destroy(defaults);
    trip_tf_destroy(tf);
}

static double difference(trip_rgba a, trip_rgba b)
{
    return fabs(a.r - b.r) + fabs(a.g - b.g) + fabs(a.b - b.b);
}

static void every_label_has_its_own_colour(void **state)
{
    (void)state;
    start(0, 12);
    for (int v = 0; v <= 12; v++)
        put(v, 100 + v);
    trip_tf *tf = labels();
    assert_true(trip_tf_evaluate(tf, 0).opacity == 0);
    for (int a = 1; a <= 12; a++) {
        assert_true(trip_tf_evaluate(tf, a).opacity >= 0.4);
        for (int b = 1; b < a; b++)
            assert_true(difference(trip_tf_evaluate(tf, a), trip_tf_evaluate(tf, b)) > 0.1);
    }
    trip_tf_destroy(tf);
}

static void a_code_next_to_a_label_has_the_same_colour(void **state)
{
    (void)state;
    start(0, 1000);
    const int there[] = { 0, 1, 2, 3, 500, 998, 999, 1000 };
    for (int i = 0; i < 8; i++)
        put(there[i], 1000);
    trip_tf *tf = labels();
    for (int i = 1; i < 8; i++) {
        trip_rgba at = trip_tf_evaluate(tf, there[i]);
        assert_true(difference(at, trip_tf_evaluate(tf, there[i] - 0.4)) < 1e-12);
        assert_true(difference(at, trip_tf_evaluate(tf, there[i] + 0.4)) < 1e-12);
    }
    assert_false(trip_tf_visible_in(tf, 0, 0.4));
    trip_tf_destroy(tf);
}

static void every_integer_of_a_wide_range_is_a_label(void **state)
{
    (void)state;
    start(0, 16383);
    put(0, 1e6);
    for (int v = 1; v <= 16383; v++)
        put(v, 10);
    trip_tf *tf = labels();
    size_t count;
    trip_tf_points(tf, &count);
    assert_int_equal(count, 2 * 16384);
    assert_true(trip_tf_evaluate(tf, 16383).opacity > 0);
    trip_tf_destroy(tf);
}

static void without_a_zero_the_most_frequent_is_the_background(void **state)
{
    (void)state;
    start(10, 14);
    put(10, 100);
    put(11, 5000);
    put(12, 100);
    put(14, 100);
    trip_tf *tf = labels();
    assert_true(trip_tf_evaluate(tf, 11).opacity == 0);
    assert_true(trip_tf_evaluate(tf, 10).opacity > 0);
    assert_true(trip_tf_evaluate(tf, 14).opacity > 0);
    trip_tf_destroy(tf);
}

static void a_binary_solid_is_solid(void **state)
{
    (void)state;
    start(0, 128);
    put(0, 1e6);
    put(128, 1e4);
    trip_tf *tf = labels();
    assert_true(trip_tf_evaluate(tf, 0).opacity == 0);
    assert_true(trip_tf_evaluate(tf, 128).opacity > 0.5);
    trip_tf_destroy(tf);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_too_large_for_integers_are_no_labels),
        cmocka_unit_test(every_label_has_its_own_colour),
        cmocka_unit_test(a_code_next_to_a_label_has_the_same_colour),
        cmocka_unit_test(every_integer_of_a_wide_range_is_a_label),
        cmocka_unit_test(without_a_zero_the_most_frequent_is_the_background),
        cmocka_unit_test(a_binary_solid_is_solid),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
