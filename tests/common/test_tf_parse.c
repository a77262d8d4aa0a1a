#include "test.h"

#include "tf_internal.h"

static void comments_blank_lines_and_both_line_ends_are_allowed(void **state)
{
    (void)state;
    static const char text[] = "\xef\xbb\xbf# a comment\r\n\n   \t\n"
                               "values data # in Hounsfield units\r\nunit voxel\n"
                               "\t-1000  0 0 0   0 # air\n+1e2 1 .5 0.25 1e-1";
    trip_tf *tf;
    assert_int_equal(trip_tf_parse(&tf, "a.tf", text, sizeof text - 1), TRIP_OK);
    assert_int_equal(tf->count, 2);
    assert_false(tf->normalised);
    assert_true(tf->unit_world == 0);
    assert_true(tf->points[0].value == -1000);
    trip_tf_point second = { 100, { 1, 0.5, 0.25, 0.1 } };
    assert_memory_equal(&tf->points[1], &second, sizeof second);
    trip_tf_destroy(tf);
}

static void directives_set_unit_and_values(void **state)
{
    (void)state;
    static const char text[] = "unit 1.5\nvalues normalised\n0 0 0 0 0\n";
    trip_tf *tf;
    assert_int_equal(trip_tf_parse(&tf, "a.tf", text, sizeof text - 1), TRIP_OK);
    assert_true(trip_tf_is_normalised(tf));
    assert_true(trip_tf_unit_world(tf) == 1.5);
    trip_tf_destroy(tf);
}

static void every_report_names_the_line(void **state)
{
    (void)state;
    static const struct {
        const char *text, *report;
    } cases[] = {
        { "0 0 0 0 0\n1 1 1 1\n", "a.tf: line 2: fewer than five numbers" },
        { "0 0 0 0 0 0\n", "a.tf: line 1: more than five numbers" },
        { "0 0 0 0 0 0 0 0 0\n", "line 1: more than five numbers" },
        { "\n\n0 0 zero 0 0\n", "line 3: `zero` is not a finite decimal number" },
        { "nan 0 0 0 0\n", "line 1: `nan` is not a finite decimal number" },
        { "0 0 0 0 inf\n", "line 1: `inf` is not a finite decimal number" },
        { "1e999 0 0 0 0\n", "line 1: `1e999` is not a finite" },
        { "0 0,5 0 0 0\n", "line 1: `0,5` is not a finite decimal number" },
        { "0x10 0 0 0 0\n", "line 1: `0x10`" },
        { "0 0 0 0 1.5\n", "line 1: the opacity is outside 0 to 1" },
        { "0 255 0 0 1\n", "line 1: a colour component is outside 0 to 1" },
        { "5 0 0 0 0\n4 0 0 0 0\n", "line 2: the value is smaller than the one before" },
        { "values normalised\n2 0 0 0 0\n", "line 2: a normalised value is outside 0 to 1" },
        { "unit\n", "line 1: `unit` takes one word" },
        { "unit 1 mm\n", "line 1: `unit` takes one word" },
        { "unit 0\n", "line 1: `unit 0`: expected" },
        { "unit -1\n", "line 1: `unit -1`: expected" },
        { "unit mm\n", "line 1: `unit mm`: expected" },
        { "unit voxel\nunit 2\n", "line 2: a second `unit`" },
        { "values percent\n", "line 1: `values percent`: expected" },
        { "values data\nvalues data\n", "line 2: a second `values`" },
        { "0 0 0 0 0\nunit 2\n", "line 2: `unit` after a point" },
        { "opacity 3\n", "line 1: fewer than five numbers" },
        { "", "a.tf: no points" },
        { "# nothing\n", "a.tf: no points" },
        { "unit voxel\nvalues data\n", "a.tf: no points" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        trip_tf *tf;
        test_catch_reports();
        assert_int_equal(trip_tf_parse(&tf, "a.tf", cases[i].text, strlen(cases[i].text)),
                         TRIP_ERROR);
        assert_one_report(cases[i].report);
        assert_null(tf);
    }
}

static void a_zero_byte_is_refused(void **state)
{
    (void)state;
    trip_tf *tf;
    test_catch_reports();
    assert_int_equal(trip_tf_parse(&tf, "a.tf", "0 0 0 0 0\n\0\n", 12), TRIP_ERROR);
    assert_one_report("line 2: a zero byte");
}

static void a_line_that_is_too_long_is_refused(void **state)
{
    (void)state;
    char text[3000];
    trip_tf *tf;
    memset(text, '#', sizeof text);
    test_catch_reports();
    assert_int_equal(trip_tf_parse(&tf, "a.tf", text, sizeof text), TRIP_ERROR);
    assert_one_report("line 1: longer than 1023 characters");
}

static void the_number_of_points_is_limited(void **state)
{
    (void)state;
    static const char line[] = "1 0 0 0 0\n";
    size_t bytes = (TRIP_TF_MAX_POINTS + 1) * (sizeof line - 1);
    char *text = malloc(bytes);
    trip_tf *tf;
    assert_non_null(text);
    for (size_t i = 0; i <= TRIP_TF_MAX_POINTS; i++)
        memcpy(text + i * (sizeof line - 1), line, sizeof line - 1);
    assert_int_equal(trip_tf_parse(&tf, "a.tf", text, bytes - (sizeof line - 1)), TRIP_OK);
    assert_int_equal(tf->count, TRIP_TF_MAX_POINTS);
    trip_tf_destroy(tf);
    test_catch_reports();
    assert_int_equal(trip_tf_parse(&tf, "a.tf", text, bytes), TRIP_ERROR);
    assert_one_report("line 65537: more than 65536 points");
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(comments_blank_lines_and_both_line_ends_are_allowed),
        cmocka_unit_test(directives_set_unit_and_values),
        cmocka_unit_test(every_report_names_the_line),
        cmocka_unit_test(a_zero_byte_is_refused),
        cmocka_unit_test(a_line_that_is_too_long_is_refused),
        cmocka_unit_test(the_number_of_points_is_limited),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
