#include "histograms.h"

static double opacity(const trip_tf *tf, double value)
{
    return trip_tf_evaluate(tf, value).opacity;
}

static void tomograms_show_bone_through_translucent_tissue(void **state)
{
    (void)state;
    trip_tf *tf;
    put_chest(-1024, 3071);
    assert_int_equal(trip_tf_ct_from_histogram(&tf, &h), TRIP_OK);
    assert_false(trip_tf_visible_in(tf, -1024, -300));
    double on_ray = 1e6 / pow((double)h.total, 2.0 / 3); /* number of muscle voxels */
    double depth = on_ray * trip_extinction(opacity(tf, 50));
    assert_true(depth > 0.8 && depth < 2);
    assert_true(opacity(tf, -100) < opacity(tf, 50));
    assert_true(opacity(tf, 500) > 0.3);
    trip_tf_destroy(tf);
}

static void tissue_of_a_head_is_visible_and_noise_is_not(void **state)
{
    (void)state;
    trip_tf *tf;
    put_head();
    assert_int_equal(trip_tf_mr_from_histogram(&tf, &h), TRIP_OK);
    assert_false(trip_tf_visible_in(tf, 0, 60)); /* four standard deviations */
    assert_true(opacity(tf, 350) > 0.02);
    assert_true(opacity(tf, 600) > 0.2);
    for (double v = 0; v < 1200; v++)
        assert_true(opacity(tf, v + 1) >= opacity(tf, v));
    trip_tf_destroy(tf);
}

static void a_few_bright_voxels_change_little(void **state)
{
    (void)state;
    trip_tf *plain, *stretched;
    put_head();
    assert_int_equal(trip_tf_mr_from_histogram(&plain, &h), TRIP_OK);
    start(0, 4095);
    put_peak(0, 1200, 0, 15, 2e6);
    put_peak(0, 1200, 350, 80, 4e5);
    put_peak(0, 1200, 600, 100, 5e5);
    put(4095, 30);
    assert_int_equal(trip_tf_mr_from_histogram(&stretched, &h), TRIP_OK);
    assert_true(fabs(opacity(plain, 600) - opacity(stretched, 600)) < 0.05);
    trip_tf_destroy(plain);
    trip_tf_destroy(stretched);
}

static void without_a_valley_the_default_function_is_used(void **state)
{
    (void)state;
    trip_tf *mr, *other;
    start(0, 255);
    for (int v = 0; v < 256; v++)
        put(v, 1e6 * exp(-v / 10.0));
    assert_int_equal(trip_tf_mr_from_histogram(&mr, &h), TRIP_OK);
    assert_int_equal(trip_tf_from_histogram(&other, &h), TRIP_OK);
    for (double v = 0; v < 256; v++)
        assert_true(opacity(mr, v) == opacity(other, v));
    trip_tf_destroy(mr);
    trip_tf_destroy(other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tomograms_show_bone_through_translucent_tissue),
        cmocka_unit_test(tissue_of_a_head_is_visible_and_noise_is_not),
        cmocka_unit_test(a_few_bright_voxels_change_little),
        cmocka_unit_test(without_a_valley_the_default_function_is_used),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
