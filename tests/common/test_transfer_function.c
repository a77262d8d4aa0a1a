#include "test.h"

#include "tf_internal.h"

#include <sys/stat.h>
#include <unistd.h>

static char folder[64];

static int make_folder(void **state)
{
    (void)state;
    strcpy(folder, "/tmp/trip_tf_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

static const char *write_file(const char *name, const char *text)
{
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    fputs(text, f);
    fclose(f);
    return path;
}

static trip_tf *from(const trip_tf_point *points, size_t count)
{
    trip_tf *tf;
    assert_int_equal(trip_tf_from_points(&tf, points, count, false, 0), TRIP_OK);
    return tf;
}

static trip_tf *from_text(const char *text)
{
    trip_tf *tf;
    assert_int_equal(trip_tf_parse(&tf, "test", text, strlen(text)), TRIP_OK);
    return tf;
}

static void assert_rgba(trip_rgba c, double r, double g, double b, double opacity)
{
    assert_close(c.r, r, 1e-15);
    assert_close(c.g, g, 1e-15);
    assert_close(c.b, b, 1e-15);
    assert_close(c.opacity, opacity, 1e-15);
}

static void colours_and_opacity_are_linear_between_points(void **state)
{
    (void)state;
    trip_tf *tf = from_text("10 0 1 0.5 0\n20 1 0 0.5 0.8\n");
    assert_rgba(trip_tf_evaluate(tf, 10), 0, 1, 0.5, 0);
    assert_rgba(trip_tf_evaluate(tf, 12.5), 0.25, 0.75, 0.5, 0.2);
    assert_rgba(trip_tf_evaluate(tf, 20), 1, 0, 0.5, 0.8);
    trip_tf_destroy(tf);
}

static void end_points_apply_outside_the_points(void **state)
{
    (void)state;
    trip_tf *tf = from_text("10 0.1 0.2 0.3 0.4\n20 0.5 0.6 0.7 0.8\n");
    assert_rgba(trip_tf_evaluate(tf, -1e300), 0.1, 0.2, 0.3, 0.4);
    assert_rgba(trip_tf_evaluate(tf, -INFINITY), 0.1, 0.2, 0.3, 0.4);
    assert_rgba(trip_tf_evaluate(tf, 1e300), 0.5, 0.6, 0.7, 0.8);
    assert_rgba(trip_tf_evaluate(tf, INFINITY), 0.5, 0.6, 0.7, 0.8);
    trip_tf_destroy(tf);
}

static void the_later_point_applies_at_a_step(void **state)
{
    (void)state;
    trip_tf *tf = from_text("0 0 0 0 0\n5 0 0 0 0\n5 1 1 1 .5\n5 1 0 0 .9\n10 1 0 0 .9\n");
    assert_rgba(trip_tf_evaluate(tf, nextafter(5, 0)), 0, 0, 0, 0);
    assert_rgba(trip_tf_evaluate(tf, 5), 1, 0, 0, 0.9);
    assert_rgba(trip_tf_evaluate_below(tf, 5), 0, 0, 0, 0);
    assert_rgba(trip_tf_evaluate_below(tf, 7), 1, 0, 0, 0.9);
    trip_tf_destroy(tf);
}

static void a_single_point_applies_everywhere(void **state)
{
    (void)state;
    trip_tf *tf = from_text("3 1 0 1 0.25\n");
    assert_rgba(trip_tf_evaluate(tf, -7), 1, 0, 1, 0.25);
    assert_rgba(trip_tf_evaluate(tf, 3), 1, 0, 1, 0.25);
    assert_true(trip_tf_visible_in(tf, 100, 200));
    trip_tf_destroy(tf);
}

static void nan_is_transparent(void **state)
{
    (void)state;
    trip_tf *tf = from_text("3 1 0 1 0.25\n");
    assert_rgba(trip_tf_evaluate(tf, NAN), 0, 0, 0, 0);
    assert_false(trip_tf_visible_in(tf, NAN, 5));
    trip_tf_destroy(tf);
}

static void values_at_the_limits_of_double_are_interpolated(void **state)
{
    (void)state;
    trip_tf *tf = from_text("-1.7e308 0 0 0 0\n1.7e308 1 1 1 1\n");
    assert_close(trip_tf_evaluate(tf, 0).opacity, 0.5, 1e-15);
    assert_close(trip_tf_evaluate(tf, 0.85e308).opacity, 0.75, 1e-15);
    trip_tf_destroy(tf);
}

static void invalid_points_are_refused(void **state)
{
    (void)state;
    static const trip_tf_point faulty[] = {
        { NAN, { 0, 0, 0, 0 } },   { INFINITY, { 0, 0, 0, 0 } }, { 0, { -0.1, 0, 0, 0 } },
        { 0, { 0, 1.1, 0, 0 } },   { 0, { 0, 0, NAN, 0 } },      { 0, { 0, 0, 0, 1.5 } },
        { 0, { 0, 0, 0, -1e-9 } },
    };
    for (size_t i = 0; i < sizeof faulty / sizeof *faulty; i++) {
        trip_tf *tf;
        test_catch_reports();
        assert_int_equal(trip_tf_from_points(&tf, &faulty[i], 1, false, 0), TRIP_ERROR);
        assert_one_report("point 1");
        assert_null(tf);
    }
}

static void no_points_decreasing_values_and_bad_units_are_refused(void **state)
{
    (void)state;
    trip_tf_point points[2] = { { 1, { 0, 0, 0, 0 } }, { 0, { 0, 0, 0, 0 } } };
    trip_tf *tf;
    test_catch_reports();
    assert_int_equal(trip_tf_from_points(&tf, points, 0, false, 0), TRIP_ERROR);
    assert_one_report("0 points");
    test_catch_reports();
    assert_int_equal(trip_tf_from_points(&tf, points, 2, false, 0), TRIP_ERROR);
    assert_one_report("point 2");
    test_catch_reports();
    assert_int_equal(trip_tf_from_points(&tf, points, 1, false, -2), TRIP_ERROR);
    assert_one_report("unit of length");
    test_catch_reports();
    assert_int_equal(trip_tf_from_points(&tf, points, 1, true, NAN), TRIP_ERROR);
    assert_one_report("unit of length");
}

static void a_normalised_function_covers_the_range_of_the_data(void **state)
{
    (void)state;
    trip_tf *tf = from_text("values normalised\n0 0 0 0 0\n0.25 1 1 1 0.5\n1 0 0 0 1\n");
    assert_true(trip_tf_is_normalised(tf));
    trip_tf_denormalise(tf, -1000, 3000);
    assert_false(trip_tf_is_normalised(tf));
    assert_rgba(trip_tf_evaluate(tf, -1000), 0, 0, 0, 0);
    assert_rgba(trip_tf_evaluate(tf, 0), 1, 1, 1, 0.5);
    assert_rgba(trip_tf_evaluate(tf, 3000), 0, 0, 0, 1);
    trip_tf_denormalise(tf, 0, 1);
    assert_rgba(trip_tf_evaluate(tf, 3000), 0, 0, 0, 1);
    trip_tf_destroy(tf);
}

static void a_normalised_function_of_constant_data_has_its_last_point(void **state)
{
    (void)state;
    trip_tf *tf = from_text("values normalised\n0 0 0 0 0\n1 1 1 1 0.5\n");
    trip_tf_denormalise(tf, 7, 7);
    assert_rgba(trip_tf_evaluate(tf, 7), 1, 1, 1, 0.5);
    trip_tf_destroy(tf);
}

static void visibility_respects_open_ends(void **state)
{
    (void)state;
    /* The function has a triangle over (10, 20) and steps at 30 and 40. The values from 30 to just
     * below 40 are visible. */
    trip_tf *tf = from_text("10 0 0 0 0\n15 0 0 0 .5\n20 0 0 0 0\n30 0 0 0 0\n30 0 0 0 .5\n"
                            "40 0 0 0 .5\n40 0 0 0 0\n");
    assert_false(trip_tf_visible_in(tf, 0, 10));
    assert_true(trip_tf_visible_in(tf, 0, nextafter(10, 11)));
    assert_true(trip_tf_visible_in(tf, 12, 12));
    assert_false(trip_tf_visible_in(tf, 20, nextafter(30, 0)));
    assert_true(trip_tf_visible_in(tf, 20, 30));
    assert_true(trip_tf_visible_in(tf, 39.5, 100));
    assert_false(trip_tf_visible_in(tf, 40, 100));
    assert_true(trip_tf_visible_in(tf, -INFINITY, INFINITY));
    assert_false(trip_tf_visible_in(tf, 20, 12));
    trip_tf_destroy(tf);
}

static void a_point_inside_a_step_is_invisible(void **state)
{
    (void)state;
    trip_tf *tf = from_text("0 0 0 0 0\n5 0 0 0 0\n5 0 0 0 1\n5 0 0 0 0\n9 0 0 0 0\n");
    assert_false(trip_tf_visible_in(tf, 0, 9));
    trip_tf_destroy(tf);
}

/* Between neighbouring critical values (points, lo, hi) opacity is linear and not negative. Some
 * opacity there is positive if and only if the opacity in the middle is positive. */
static bool visible_by_sampling(const trip_tf *tf, double lo, double hi)
{
    bool visible = false;
    for (int half = 0; half <= 64; half++) { /* points, lo and hi are integers from 0 to 32 */
        double value = half / 2.0;
        if (value >= lo && value <= hi)
            visible = visible || trip_tf_evaluate(tf, value).opacity > 0;
    }
    return visible;
}

static void visibility_equals_sampling_for_random_functions(void **state)
{
    (void)state;
    for (int round = 0; round < 3000; round++) {
        trip_tf_point points[12] = { 0 };
        size_t count = 1 + (size_t)(12 * test_random());
        double value = floor(8 * test_random());
        for (size_t i = 0; i < count; i++) {
            points[i].value = value;
            points[i].colour.opacity = test_random() < 0.7 ? 0 : test_random();
            value += test_random() < 0.4 ? 0 : floor(4 * test_random());
            value = value > 32 ? 32 : value;
        }
        trip_tf *tf = from(points, count);
        for (int i = 0; i < 20; i++) {
            double lo = floor(33 * test_random()), hi = lo + floor((33 - lo) * test_random());
            assert_int_equal(trip_tf_visible_in(tf, lo, hi), visible_by_sampling(tf, lo, hi));
        }
        trip_tf_destroy(tf);
    }
}

static void extinction_gives_the_opacity_of_any_thickness(void **state)
{
    (void)state;
    static const double opacities[] = { 0, 0.001, 0.3, 0.9, 0.9999 };
    for (size_t i = 0; i < sizeof opacities / sizeof *opacities; i++)
        for (double length = 0.5; length < 10; length *= 2)
            assert_close(1 - exp(-trip_extinction(opacities[i]) * length),
                         1 - pow(1 - opacities[i], length), 1e-14);
    assert_true(trip_extinction(1) == trip_extinction(TRIP_OPACITY_MAX));
    assert_true(trip_extinction(0) == 0);
}

static trip_tf_entry table[65536];

static void the_table_has_the_function_at_every_code(void **state)
{
    (void)state;
    trip_tf *tf = from_text("-1000 0 1 0 0\n3000 1 0 0.5 0.5\n");
    trip_tf_fill_table(tf, -1000, 3000, 2, table);
    for (int code = 0; code < 65536; code++) {
        double t = code / 65535.0;
        assert_close(table[code].r, t, 1e-7);
        assert_close(table[code].g, 1 - t, 1e-7);
        assert_close(table[code].b, 0.5 * t, 1e-7);
        assert_close(table[code].extinction, -log(1 - 0.5 * t) / 2, 1e-7);
    }
    trip_tf_destroy(tf);
}

/* Codes are 1/16 apart. */
static void peaks_narrower_than_a_code_are_found(void **state)
{
    (void)state;
    static const struct {
        const char *points;
        double value; /* 0 if no peak is lost */
    } functions[] = {
        { "0 1 1 1 0\n99.99 1 1 1 0\n100.02 1 1 1 0.9\n100.05 1 1 1 0\n", 100.02 },
        { "0 1 1 1 0\n99.9 1 1 1 0\n100.02 1 1 1 0.9\n100.1 1 1 1 0\n", 0 },
        { "0 1 1 1 0.8\n100.01 1 1 1 0.8\n100.02 1 1 1 0.9\n100.03 1 1 1 0.8\n", 0 },
        { "0 1 1 1 0\n100.01 1 1 1 0\n100.02 1 1 1 0.9\n", 0 },             /* a step */
        { "0 1 1 1 0\n99.99 1 1 1 0\n100 1 1 1 0.9\n100.01 1 1 1 0\n", 0 }, /* at a code */
        { "0 1 1 1 0\n100.02 1 1 1 0\n100.03 1 1 1 0.001\n100.04 1 1 1 0\n", 0 },
        { "5000 1 1 1 0\n5000.02 1 1 1 1\n5000.04 1 1 1 0\n", 0 }, /* beyond the data */
    };
    for (size_t i = 0; i < sizeof functions / sizeof *functions; i++) {
        trip_tf *tf = from_text(functions[i].points);
        trip_tf_point peak = { 0 };
        assert_int_equal(trip_tf_lost_peak(tf, 0, 65535.0 / 16, &peak), functions[i].value > 0);
        assert_true(peak.value == functions[i].value);
        assert_false(trip_tf_lost_peak(tf, 100, 100, &peak));
        trip_tf_destroy(tf);
    }
}

static void a_unit_in_world_space_replaces_the_voxel(void **state)
{
    (void)state;
    trip_tf *tf = from_text("unit 0.25\n0 1 1 1 0.5\n");
    assert_true(trip_tf_unit_world(tf) == 0.25);
    trip_tf_fill_table(tf, 0, 0, 2, table);
    assert_close(table[0].extinction, log(2) / 0.25, 1e-6);
    assert_close(table[65535].extinction, log(2) / 0.25, 1e-6);
    trip_tf_destroy(tf);
}

static void the_text_format_keeps_every_bit(void **state)
{
    (void)state;
    trip_tf_point points[20];
    for (size_t i = 0; i < 20; i++)
        points[i] = (trip_tf_point){ (double)(i / 2) / 11,
                                     { test_random(), test_random(), 1.0 / 3, test_random() } };
    for (int normalised = 0; normalised < 2; normalised++) {
        trip_tf *tf, *again;
        assert_int_equal(trip_tf_from_points(&tf, points, 20, normalised, normalised ? 0.1 : 0),
                         TRIP_OK);
        char *text = trip_tf_to_text(tf);
        assert_int_equal(trip_tf_parse(&again, "again", text, strlen(text)), TRIP_OK);
        assert_int_equal(again->count, 20);
        assert_memory_equal(again->points, points, sizeof points);
        assert_int_equal(again->normalised, normalised);
        assert_true(again->unit_world == tf->unit_world);
        free(text);
        trip_tf_destroy(tf);
        trip_tf_destroy(again);
    }
}

static void load_recognises_text_and_json_by_content(void **state)
{
    (void)state;
    trip_tf *tf;
    assert_int_equal(trip_tf_load(&tf, write_file("a.json", "5 1 0 0 0.5\n")), TRIP_OK);
    assert_int_equal(tf->count, 1);
    trip_tf_destroy(tf);
    assert_int_equal(
        trip_tf_load(&tf, write_file("b.tf", " \n[{\"RGBPoints\":[0,0,0,0,9,1,1,1]}]")), TRIP_OK);
    assert_rgba(trip_tf_evaluate(tf, 9), 1, 1, 1, 1);
    trip_tf_destroy(tf);
}

static void load_selects_the_preset_after_the_hash(void **state)
{
    (void)state;
    trip_tf *tf;
    char path[300];
    const char *file = write_file("two.json", "[{\"Name\":\"a\",\"RGBPoints\":[5,1,0,0]},"
                                              "{\"Name\":\"b\",\"RGBPoints\":[5,0,0,1]}]");
    snprintf(path, sizeof path, "%s#b", file);
    assert_int_equal(trip_tf_load(&tf, path), TRIP_OK);
    assert_true(trip_tf_evaluate(tf, 5).b == 1);
    trip_tf_destroy(tf);
    snprintf(path, sizeof path, "%s#c", file);
    test_catch_reports();
    assert_int_equal(trip_tf_load(&tf, path), TRIP_ERROR);
    assert_one_report("no colour map named `c`");
    snprintf(path, sizeof path, "%s#b", write_file("a.tf", "5 1 0 0 1\n"));
    test_catch_reports();
    assert_int_equal(trip_tf_load(&tf, path), TRIP_ERROR);
    assert_one_report("#b");
}

static void a_file_with_a_hash_in_its_name_is_found(void **state)
{
    (void)state;
    trip_tf *tf;
    assert_int_equal(trip_tf_load(&tf, write_file("a#b.tf", "5 1 0 0 1\n")), TRIP_OK);
    trip_tf_destroy(tf);
}

static void an_unreadable_file_gives_one_line(void **state)
{
    (void)state;
    trip_tf *tf;
    test_catch_reports();
    assert_int_equal(trip_tf_load(&tf, "/nowhere/x.tf"), TRIP_ERROR);
    assert_one_report("/nowhere/x.tf: cannot open");
    assert_null(tf);
    test_catch_reports();
    assert_int_equal(trip_tf_load(&tf, folder), TRIP_ERROR);
    assert_one_report("cannot read");
    test_catch_reports();
    assert_int_equal(trip_tf_load(&tf, "/dev/zero"), TRIP_ERROR);
    assert_one_report("longer than 8 MiB");
    test_catch_reports();
    assert_int_equal(trip_tf_load(&tf, "/dev/null"), TRIP_ERROR);
    assert_one_report("no points");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colours_and_opacity_are_linear_between_points),
        cmocka_unit_test(end_points_apply_outside_the_points),
        cmocka_unit_test(the_later_point_applies_at_a_step),
        cmocka_unit_test(a_single_point_applies_everywhere),
        cmocka_unit_test(nan_is_transparent),
        cmocka_unit_test(values_at_the_limits_of_double_are_interpolated),
        cmocka_unit_test(invalid_points_are_refused),
        cmocka_unit_test(no_points_decreasing_values_and_bad_units_are_refused),
        cmocka_unit_test(a_normalised_function_covers_the_range_of_the_data),
        cmocka_unit_test(a_normalised_function_of_constant_data_has_its_last_point),
        cmocka_unit_test(visibility_respects_open_ends),
        cmocka_unit_test(a_point_inside_a_step_is_invisible),
        cmocka_unit_test(visibility_equals_sampling_for_random_functions),
        cmocka_unit_test(extinction_gives_the_opacity_of_any_thickness),
        cmocka_unit_test(the_table_has_the_function_at_every_code),
        cmocka_unit_test(peaks_narrower_than_a_code_are_found),
        cmocka_unit_test(a_unit_in_world_space_replaces_the_voxel),
        cmocka_unit_test(the_text_format_keeps_every_bit),
        cmocka_unit_test(load_recognises_text_and_json_by_content),
        cmocka_unit_test(load_selects_the_preset_after_the_hash),
        cmocka_unit_test(a_file_with_a_hash_in_its_name_is_found),
        cmocka_unit_test(an_unreadable_file_gives_one_line),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
