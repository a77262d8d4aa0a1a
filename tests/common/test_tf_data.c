#include "histograms.h"

#include "tf_internal.h"

static trip_tf *parse(const char *text)
{
    trip_tf *tf;
    assert_int_equal(trip_tf_parse(&tf, "test", text, strlen(text)), TRIP_OK);
    return tf;
}

static void a_window_covers_the_points_of_a_function_in_data_units(void **state)
{
    (void)state;
    trip_tf *tf = parse("10 0 0 0 0\n20 0.5 0 0 0.5\n50 1 0 0 1\n");
    assert_int_equal(trip_tf_window(tf, 400, 40), TRIP_OK);
    const double expected[] = { -160, -160 + 400 * 0.25, 240 };
    for (int i = 0; i < 3; i++)
        assert_close(tf->points[i].value, expected[i], 1e-12);
    assert_close(trip_tf_evaluate(tf, -110).r, 0.25, 1e-12);
    trip_tf_destroy(tf);
}

static void a_window_covers_0_to_1_of_a_normalised_function(void **state)
{
    (void)state;
    trip_tf *tf = parse("values normalised\n0.25 0 0 0 0\n0.75 1 1 1 1\n");
    assert_int_equal(trip_tf_window(tf, 100, 1000), TRIP_OK);
    assert_false(trip_tf_is_normalised(tf));
    assert_close(tf->points[0].value, 975, 1e-12);
    assert_close(tf->points[1].value, 1025, 1e-12);
    trip_tf_destroy(tf);
}

static void impossible_windows_are_refused(void **state)
{
    (void)state;
    const struct {
        const char *text;
        double width, level;
    } bad[] = { { "1 0 0 0 0\n", 10, 0 },
                { "1 0 0 0 0\n1 0 0 0 1\n", 10, 0 },
                { "1 0 0 0 0\n2 0 0 0 1\n", 1e-30, 1e10 },
                { "1 0 0 0 0\n2 0 0 0 1\n", 1.7e308, 1.7e308 },
                { "1 0 0 0 0\n2 0 0 0 1\n", 0, 1 } };
    for (int i = 0; i < 5; i++) {
        trip_tf *tf = parse(bad[i].text);
        test_catch_reports();
        assert_int_equal(trip_tf_window(tf, bad[i].width, bad[i].level), TRIP_USAGE);
        assert_one_report("--window");
        trip_tf_destroy(tf);
    }
}

static void a_window_of_the_widest_function_keeps_the_order(void **state)
{
    (void)state;
    trip_tf *tf = parse("-1.7e308 0 0 0 0\n0 0 0 0 1\n1.7e308 0 0 0 1\n");
    assert_int_equal(trip_tf_window(tf, 2, 5), TRIP_OK);
    for (int i = 0; i < 3; i++)
        assert_close(tf->points[i].value, 4 + i, 1e-12);
    trip_tf_destroy(tf);
}

static void automatic_transfer_functions_need_a_histogram(void **state)
{
    (void)state;
    trip_tf *tf, *expected;
    put_chest(-1024, 3071);
    assert_int_equal(trip_tf_load(&tf, "auto"), TRIP_OK);
    assert_true(trip_tf_needs_data(tf));
    trip_tf_data data = { h.value_min, h.value_max, NULL, TRIP_TF_CT };
    test_catch_reports();
    assert_int_equal(trip_tf_adapt(tf, &data, "a.trip"), TRIP_ERROR);
    assert_one_report("a.trip: has no histogram");
    data.histogram = &h;
    assert_int_equal(trip_tf_adapt(tf, &data, "a.trip"), TRIP_OK);
    assert_int_equal(trip_tf_ct_from_histogram(&expected, &h), TRIP_OK);
    assert_false(trip_tf_needs_data(tf));
    assert_int_equal(tf->count, expected->count);
    assert_memory_equal(tf->points, expected->points, tf->count * sizeof *tf->points);
    trip_tf_destroy(tf);
    trip_tf_destroy(expected);
}

static void check_warning(const char *name, double lo, double hi, const char *part)
{
    trip_tf *tf;
    assert_int_equal(trip_tf_load(&tf, name), TRIP_OK);
    trip_tf_denormalise(tf, lo, hi);
    test_catch_reports();
    trip_tf_check_range(tf, lo, hi, "a.trip");
    if (part)
        assert_one_report(part);
    else
        assert_int_equal(test_caught_reports(), 0);
    trip_tf_destroy(tf);
}

static void presets_for_ct_warn_of_other_values(void **state)
{
    (void)state;
    check_warning("ct-bone", -1024, 3071, NULL);
    check_warning("ct-bone", -3024, 1900, NULL);
    check_warning("ct-bone", 0, 255, "do not look like the Hounsfield units");
    check_warning("ct-soft", 0, 1, "do not look like the Hounsfield units");
    check_warning("ct-skin", 0, 4095, "do not look like the Hounsfield units");
    check_warning("bone", 0, 255, NULL);
    check_warning("ct-bone", -1024, 120, "no value from -1024 to 120 is visible");
}

static void the_visible_span_ends_at_the_neighbouring_points(void **state)
{
    (void)state;
    double span[2];
    trip_tf *tf = parse("0 0 0 0 0\n10 0 0 0 0\n20 0 0 0 1\n30 0 0 0 0\n40 0 0 0 0\n");
    assert_true(trip_tf_visible_span(tf, -100, 100, span));
    assert_true(span[0] == 10 && span[1] == 30);
    assert_true(trip_tf_visible_span(tf, 15, 17, span));
    assert_true(span[0] == 15 && span[1] == 17);
    assert_false(trip_tf_visible_span(tf, 35, 100, span));
    trip_tf_destroy(tf);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_window_covers_the_points_of_a_function_in_data_units),
        cmocka_unit_test(a_window_covers_0_to_1_of_a_normalised_function),
        cmocka_unit_test(impossible_windows_are_refused),
        cmocka_unit_test(a_window_of_the_widest_function_keeps_the_order),
        cmocka_unit_test(automatic_transfer_functions_need_a_histogram),
        cmocka_unit_test(presets_for_ct_warn_of_other_values),
        cmocka_unit_test(the_visible_span_ends_at_the_neighbouring_points),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
