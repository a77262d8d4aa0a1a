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

static bool has_basis(size_t i, const char *basis)
{
    return strcmp(trip_tf_preset_basis(i), basis) == 0;
}

static void points_of_presets_match_their_basis(void **state)
{
    (void)state;
    int over_range = 0, hounsfield = 0, made = 0;
    for (size_t i = 0; trip_tf_preset_name(i); i++) {
        trip_tf *tf = preset(trip_tf_preset_name(i));
        assert_true(trip_tf_is_normalised(tf) == has_basis(i, "data's range"));
        if (trip_tf_is_normalised(tf))
            assert_true(tf->points[0].value == 0 && tf->points[tf->count - 1].value == 1);
        over_range += trip_tf_is_normalised(tf);
        hounsfield += tf->hounsfield;
        made += tf->made;
        assert_true(strlen(trip_tf_preset_summary(i)) > 0);
        trip_tf_destroy(tf);
    }
    assert_true(over_range >= 6);
    assert_int_equal(hounsfield, 4);
    assert_int_equal(made, TRIP_TF_KINDS);
}

static void presets_over_the_range_hide_only_its_minimum(void **state)
{
    (void)state;
    for (size_t n = 0; trip_tf_preset_name(n); n++) {
        if (!has_basis(n, "data's range"))
            continue;
        trip_tf *tf = preset(trip_tf_preset_name(n));
        assert_true(trip_tf_evaluate(tf, 0).opacity == 0);
        assert_true(trip_tf_evaluate(tf, 1).opacity > 0);
        for (int i = 1; i <= 100; i++)
            assert_true(trip_tf_evaluate(tf, i / 100.0).opacity >=
                        trip_tf_evaluate(tf, (i - 1) / 100.0).opacity);
        trip_tf_destroy(tf);
    }
}

static void the_report_of_an_unknown_preset_names_the_list(void **state)
{
    (void)state;
    trip_tf *tf;
    test_catch_reports();
    assert_int_equal(trip_tf_load(&tf, "preset:jet"), TRIP_USAGE);
    assert_one_report("no preset `jet`; `triptych tf list` lists the presets");
    assert_null(tf);
}

static bool shows(const char *name, double value)
{
    trip_tf *tf = preset(name);
    bool shown = trip_tf_evaluate(tf, value).opacity > 0;
    trip_tf_destroy(tf);
    return shown;
}

/* In Hounsfield units, air is -1000, lung -800 to -500, fat -100, muscle 50, spongy bone 300 and
 * dense bone 1000. */
static void presets_for_ct_show_their_tissue(void **state)
{
    (void)state;
    const double values[] = { -1000, -700, -100, 50, 300, 1000 };
    const struct {
        const char *name;
        bool shown[6];
    } expected[] = {
        { "ct-bone", { 0, 0, 0, 0, 1, 1 } },
        { "ct-soft", { 0, 0, 1, 1, 1, 1 } },
        { "ct-lung", { 0, 1, 0, 0, 0, 0 } },
        { "ct-skin", { 0, 0, 1, 1, 1, 1 } },
    };
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 6; k++)
            assert_int_equal(shows(expected[i].name, values[k]), expected[i].shown[k]);
}

static void a_mistyped_name_suggests_a_preset(void **state)
{
    (void)state;
    trip_tf *tf;
    const char *const slips[][2] = { { "bnoe", "preset:bone" },
                                     { "Bone", "preset:bone" },
                                     { "no/such/folder/ct_bone.tf", "preset:ct-bone" },
                                     { "hot-metl", "preset:hot-metal" },
                                     { "ctbone", "preset:ct-bone" } };
    for (int i = 0; i < 5; i++) {
        test_catch_reports();
        assert_int_equal(trip_tf_load(&tf, slips[i][0]), TRIP_ERROR);
        assert_one_report(slips[i][1]);
    }
    test_catch_reports();
    assert_int_equal(trip_tf_load(&tf, "nothing-like-it"), TRIP_ERROR);
    assert_null(strstr(test_last_report, "did you mean"));
    assert_one_report("no such file or preset; `triptych tf list` lists the presets");
    test_catch_reports();
    assert_int_equal(trip_tf_load(&tf, "folder/nothing.tf"), TRIP_ERROR);
    assert_one_report("No such file");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_of_presets_match_their_basis),
        cmocka_unit_test(presets_over_the_range_hide_only_its_minimum),
        cmocka_unit_test(presets_for_ct_show_their_tissue),
        cmocka_unit_test(a_mistyped_name_suggests_a_preset),
        cmocka_unit_test(the_report_of_an_unknown_preset_names_the_list),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
