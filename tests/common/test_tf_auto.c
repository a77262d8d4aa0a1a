#include "test.h"

#include "tf_internal.h"

static trip_histogram h;

static trip_tf *automatic(void)
{
    trip_tf *tf;
    h.total = 0;
    for (int i = 0; i < 1024; i++)
        h.total += h.counts[i];
    assert_int_equal(trip_tf_from_histogram(&tf, &h), TRIP_OK);
    assert_false(trip_tf_is_normalised(tf));
    return tf;
}

static void start(double value_min, double value_max)
{
    memset(&h, 0, sizeof h);
    h.value_min = value_min;
    h.value_max = value_max;
}

static void put(double value, double count)
{
    int bin = (int)((value - h.value_min) / (h.value_max - h.value_min) * 1024);
    h.counts[bin < 1024 ? bin : 1023] += (uint64_t)count;
}

/* Adds `count` voxels with a normal distribution over the values lo, lo + 1, ... hi. */
static void put_peak(double lo, double hi, double mean, double deviation, double count)
{
    for (double v = lo; v <= hi; v++) {
        double x = (v - mean) / deviation;
        put(v, count / (deviation * 2.5066) * exp(-x * x / 2));
    }
}

static double opacity(const trip_tf *tf, double value)
{
    return trip_tf_evaluate(tf, value).opacity;
}

static double luminance(trip_rgba c)
{
    return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b;
}

static void one_value_is_fog_of_moderate_depth(void **state)
{
    (void)state;
    for (int edge = 10; edge <= 1000; edge *= 10) {
        start(7, 7);
        h.counts[0] = (uint64_t)edge * (uint64_t)edge * (uint64_t)edge;
        trip_tf *tf = automatic();
        double through_a_cube = 1 - pow(1 - opacity(tf, 7), edge);
        assert_true(through_a_cube > 0.6 && through_a_cube < 0.8);
        trip_tf_destroy(tf);
    }
}

static void an_empty_histogram_gives_a_transfer_function(void **state)
{
    (void)state;
    start(0, 0);
    trip_tf_destroy(automatic());
}

static void of_two_values_only_the_upper_one_is_visible(void **state)
{
    (void)state;
    start(0, 128);
    put(0, 77);
    put(128, 23);
    trip_tf *tf = automatic();
    assert_true(opacity(tf, 0) == 0);
    assert_true(opacity(tf, 128) > 0.5);
    trip_tf_destroy(tf);
}

static void an_angiogram_shows_all_values_but_zero(void **state)
{
    (void)state;
    start(0, 255);
    put(0, 16.6e6);
    for (int v = 1; v < 256; v++)
        put(v, 20000.0 / v + 300);
    trip_tf *tf = automatic();
    assert_true(opacity(tf, 0) == 0);
    assert_false(trip_tf_visible_in(tf, 0, 1));
    assert_true(opacity(tf, 60) > 0.01);
    assert_true(opacity(tf, 255) > 0.5);
    trip_tf_destroy(tf);
}

/* The background is the lowest peak, although another peak has three times as many voxels. */
static void a_small_background_is_hidden_too(void **state)
{
    (void)state;
    start(0, 1000);
    put_peak(0, 1000, 100, 10, 1e6);
    put_peak(0, 1000, 500, 10, 3e6);
    put_peak(0, 1000, 900, 10, 1e5);
    trip_tf *tf = automatic();
    assert_false(trip_tf_visible_in(tf, 0, 120));
    assert_true(opacity(tf, 500) > 0);
    assert_true(opacity(tf, 900) > opacity(tf, 500));
    trip_tf_destroy(tf);
}

/* The background ends with a group of 16 of the 1024 bins. Stored values may be up to half a code
 * of 65535 higher. */
static void background_values_rounded_up_to_a_code_are_hidden(void **state)
{
    (void)state;
    start(0, 1024);
    put(7.5, 1e6);
    for (int v = 600; v < 1000; v++)
        put(v, 100);
    trip_tf *tf = automatic();
    assert_true(opacity(tf, 16 + 0.5 * 1024 / 65535) == 0);
    assert_true(opacity(tf, 900) > 0);
    trip_tf_destroy(tf);
}

static void a_tomogram_shows_bone_through_translucent_tissue(void **state)
{
    (void)state;
    start(-1000, 2000);
    put_peak(-1000, 2000, -900, 40, 6e6);
    put_peak(-1000, 2000, 40, 30, 3e6);
    put_peak(-1000, 2000, 900, 200, 3e5);
    trip_tf *tf = automatic();
    assert_false(trip_tf_visible_in(tf, -1000, -850));
    assert_in_range(1000 * opacity(tf, 40), 1, 150);
    assert_true(opacity(tf, 900) > 0.3);
    assert_true(opacity(tf, 900) > 5 * opacity(tf, 40));
    trip_tf_destroy(tf);
}

static void a_few_values_below_the_background_do_not_replace_it(void **state)
{
    (void)state;
    start(0, 1300);
    put_peak(0, 1300, 370, 25, 1e6);
    put_peak(0, 1300, 850, 30, 4e5);
    for (int v = 0; v < 300; v++)
        put(v, 20);
    trip_tf *tf = automatic();
    assert_false(trip_tf_visible_in(tf, 0, 390));
    assert_true(opacity(tf, 880) > 0.05);
    trip_tf_destroy(tf);
}

static void fog_with_a_long_tail_shows_its_dense_part(void **state)
{
    (void)state;
    start(1e-5, 5.7);
    for (int i = 0; i < 5700; i++)
        put(i / 1000.0, 2e5 * exp(-i / 300.0));
    trip_tf *tf = automatic();
    assert_true(opacity(tf, 1e-5) == 0);
    assert_true(opacity(tf, 1) > 0.02);
    assert_true(opacity(tf, 3) > 0.2); /* ten voxels are 90 % opaque */
    trip_tf_destroy(tf);
}

static void for_a_bright_background_opacity_falls_with_the_value(void **state)
{
    (void)state;
    start(0, 255);
    put_peak(0, 255, 80, 15, 2e5);
    put(255, 5e6);
    trip_tf *tf = automatic();
    assert_true(opacity(tf, 255) == 0);
    assert_true(opacity(tf, 60) > 0.1);
    assert_true(opacity(tf, 60) > opacity(tf, 100));
    trip_tf_destroy(tf);
}

static void background_at_the_end_of_a_group_of_bins_is_hidden(void **state)
{
    (void)state;
    start(0, 1);
    double background = nextafter(16.0 / 1024, 0); /* end of a group of bins */
    put(background, 9e5);
    put(0, 2);
    for (int i = 100; i < 1000; i++)
        put(i / 1000.0, 100);
    trip_tf *tf = automatic();
    assert_true(opacity(tf, ceil(background * 65535) / 65535) == 0);
    trip_tf_destroy(tf);
}

static void opacity_and_luminance_rise_with_the_value(void **state)
{
    (void)state;
    start(0, 255);
    put_peak(0, 255, 10, 5, 1e6);
    put_peak(0, 255, 120, 20, 3e5);
    put_peak(0, 255, 220, 10, 5e4);
    trip_tf *tf = automatic();
    assert_true(tf->count > 10);
    for (size_t i = 1; i < tf->count; i++) {
        assert_true(tf->points[i].value > tf->points[i - 1].value);
        assert_true(tf->points[i].colour.opacity >= tf->points[i - 1].colour.opacity);
        assert_true(luminance(tf->points[i].colour) > luminance(tf->points[i - 1].colour));
    }
    trip_tf_destroy(tf);
}

static void a_range_that_is_not_finite_is_refused(void **state)
{
    (void)state;
    trip_tf *tf;
    start(NAN, 5);
    test_catch_reports();
    assert_int_equal(trip_tf_from_histogram(&tf, &h), TRIP_ERROR);
    assert_one_report("not a finite number");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_value_is_fog_of_moderate_depth),
        cmocka_unit_test(an_empty_histogram_gives_a_transfer_function),
        cmocka_unit_test(of_two_values_only_the_upper_one_is_visible),
        cmocka_unit_test(an_angiogram_shows_all_values_but_zero),
        cmocka_unit_test(a_small_background_is_hidden_too),
        cmocka_unit_test(background_values_rounded_up_to_a_code_are_hidden),
        cmocka_unit_test(a_tomogram_shows_bone_through_translucent_tissue),
        cmocka_unit_test(a_few_values_below_the_background_do_not_replace_it),
        cmocka_unit_test(fog_with_a_long_tail_shows_its_dense_part),
        cmocka_unit_test(for_a_bright_background_opacity_falls_with_the_value),
        cmocka_unit_test(background_at_the_end_of_a_group_of_bins_is_hidden),
        cmocka_unit_test(opacity_and_luminance_rise_with_the_value),
        cmocka_unit_test(a_range_that_is_not_finite_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
