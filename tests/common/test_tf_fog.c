#include "test.h"

#include "tf_internal.h"

static trip_histogram h;

/* Makes a histogram of `count` voxels with exponentially distributed densities, as in smoke. */
static void put_smoke(double value_max, double mean, double count)
{
    memset(&h, 0, sizeof h);
    h.value_max = value_max;
    for (int i = 0; i < 1024; i++)
        h.counts[i] =
            (uint64_t)(count * value_max / 1024 / mean * exp(-value_max * (i + 0.5) / 1024 / mean));
}

static trip_tf *automatic(void)
{
    trip_tf *tf;
    assert_int_equal(trip_tf_fog_from_histogram(&tf, &h), TRIP_OK);
    assert_false(trip_tf_is_normalised(tf));
    return tf;
}

static double extinction(const trip_tf *tf, double value)
{
    return trip_extinction(trip_tf_evaluate(tf, value).opacity);
}

static void extinction_is_proportional_to_density(void **state)
{
    (void)state;
    put_smoke(2, 0.2, 1e6);
    trip_tf *tf = automatic();
    for (double v = 0.1; v < 1.9; v += 0.1)
        assert_true(fabs(extinction(tf, v) / extinction(tf, 1) - v) < 0.04);
    trip_tf_destroy(tf);
}

static void a_ray_through_the_fog_has_an_optical_depth_of_about_4(void **state)
{
    (void)state;
    const double counts[] = { 1e5, 1e7, 1e9 }, scales[] = { 1e-3, 1, 1e4 };
    for (int i = 0; i < 9; i++) {
        double scale = scales[i % 3];
        put_smoke(8 * scale, scale, counts[i / 3]);
        trip_tf *tf = automatic();
        double depth = cbrt(counts[i / 3]) * extinction(tf, scale);
        assert_true(depth > 3.5 && depth < 4.2);
        trip_tf_destroy(tf);
    }
}

static void the_lowest_densities_are_invisible(void **state)
{
    (void)state;
    put_smoke(1, 0.1, 1e6);
    trip_tf *tf = automatic();
    assert_false(trip_tf_visible_in(tf, 0, 0.001));
    assert_true(trip_tf_visible_in(tf, 0.003, 0.003));
    trip_tf_destroy(tf);
}

static void colours_are_close_to_white(void **state)
{
    (void)state;
    put_smoke(1, 0.1, 1e6);
    trip_tf *tf = automatic();
    for (double v = 0; v < 1; v += 0.05) {
        trip_rgba c = trip_tf_evaluate(tf, v).opacity > 0 ? trip_tf_evaluate(tf, v)
                                                          : (trip_rgba){ 1, 1, 1, 0 };
        assert_true(fmin(c.r, fmin(c.g, c.b)) > 0.65);
        assert_true(fmax(c.r, fmax(c.g, c.b)) - fmin(c.r, fmin(c.g, c.b)) < 0.15);
    }
    trip_tf_destroy(tf);
}

static void a_mostly_full_volume_is_drawn_as_a_solid(void **state)
{
    (void)state;
    memset(&h, 0, sizeof h);
    h.value_max = 1;
    h.counts[500] = 1000;
    h.counts[1023] = 1000000;
    trip_tf *tf = automatic();
    assert_true(trip_tf_evaluate(tf, 1).opacity > 0.25);
    trip_tf_destroy(tf);
}

static void values_that_are_no_densities_get_the_default_function(void **state)
{
    (void)state;
    trip_tf *fog, *other;
    const double lowest[] = { -1, 2, 2 }; /* a negative value, a single value, no voxel */
    for (int i = 0; i < 3; i++) {
        put_smoke(2, 0.3, i < 2 ? 1e5 : 0);
        h.value_min = lowest[i];
        assert_int_equal(trip_tf_fog_from_histogram(&fog, &h), TRIP_OK);
        assert_int_equal(trip_tf_from_histogram(&other, &h), TRIP_OK);
        assert_int_equal(fog->count, other->count);
        for (size_t k = 0; k < fog->count; k++)
            assert_true(fog->points[k].value == other->points[k].value &&
                        fog->points[k].colour.opacity == other->points[k].colour.opacity);
        trip_tf_destroy(fog);
        trip_tf_destroy(other);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(extinction_is_proportional_to_density),
        cmocka_unit_test(a_ray_through_the_fog_has_an_optical_depth_of_about_4),
        cmocka_unit_test(the_lowest_densities_are_invisible),
        cmocka_unit_test(colours_are_close_to_white),
        cmocka_unit_test(a_mostly_full_volume_is_drawn_as_a_solid),
        cmocka_unit_test(values_that_are_no_densities_get_the_default_function),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
