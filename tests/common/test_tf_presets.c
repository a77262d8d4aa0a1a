#include "test.h"

#include "tf_internal.h"

static trip_tf *preset(const char *name)
{
    char text[64];
    trip_tf *tf;
    snprintf(text, sizeof text, "preset:%s", name);
    assert_int_equal(trip_tf_load(&tf, text), TRIP_OK);
    return tf;
}

static void every_name_loads_over_the_whole_range(void **state)
{
    (void)state;
    size_t count = 0;
    for (const char *const *name = trip_tf_preset_names(); *name; name++, count++) {
        trip_tf *tf = preset(*name);
        assert_true(trip_tf_is_normalised(tf));
        assert_true(tf->points[0].value == 0);
        assert_true(tf->points[tf->count - 1].value == 1);
        trip_tf_destroy(tf);
    }
    assert_true(count >= 5);
}

static void every_preset_hides_the_lowest_value_and_shows_the_highest(void **state)
{
    (void)state;
    for (const char *const *name = trip_tf_preset_names(); *name; name++) {
        trip_tf *tf = preset(*name);
        assert_true(trip_tf_evaluate(tf, 0).opacity == 0);
        assert_true(trip_tf_evaluate(tf, 1).opacity > 0);
        for (int i = 1; i <= 100; i++)
            assert_true(trip_tf_evaluate(tf, i / 100.0).opacity >=
                        trip_tf_evaluate(tf, (i - 1) / 100.0).opacity);
        trip_tf_destroy(tf);
    }
}

static void unknown_preset_lists_the_known_ones(void **state)
{
    (void)state;
    trip_tf *tf;
    test_catch_reports();
    assert_int_equal(trip_tf_load(&tf, "preset:jet"), TRIP_USAGE);
    for (const char *const *name = trip_tf_preset_names(); *name; name++)
        assert_non_null(strstr(test_last_report, *name));
    assert_one_report("no preset `jet`");
    assert_null(tf);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_name_loads_over_the_whole_range),
        cmocka_unit_test(every_preset_hides_the_lowest_value_and_shows_the_highest),
        cmocka_unit_test(unknown_preset_lists_the_known_ones),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
