#include "test.h"

#include "tf_internal.h"

static trip_tf *parse(const char *text)
{
    trip_tf *tf;
    assert_int_equal(trip_tf_parse_any(&tf, "test", text, strlen(text), NULL), TRIP_OK);
    return tf;
}

/* Writes `tf` in a format and reads it back. */
static trip_tf *again(const trip_tf *tf, trip_tf_format format)
{
    char *text;
    assert_int_equal(trip_tf_write(tf, format, "it's \"<a> & b\"", &text), TRIP_OK);
    trip_tf *other = parse(text);
    free(text);
    return other;
}

static void assert_same_at(const trip_tf *a, const trip_tf *b, double value)
{
    trip_rgba p = trip_tf_evaluate(a, value), q = trip_tf_evaluate(b, value);
    assert_close(p.r, q.r, 1e-12);
    assert_close(p.g, q.g, 1e-12);
    assert_close(p.b, q.b, 1e-12);
    assert_close(p.opacity, q.opacity, 1e-12);
}

/* Compares at every point, just below it, half way to the next point, and beyond the ends. */
static void assert_same(const trip_tf *a, const trip_tf *b)
{
    assert_true(trip_tf_is_normalised(a) == trip_tf_is_normalised(b));
    for (size_t i = 0; i < a->count; i++) {
        double value = a->points[i].value, next = a->points[i + (i + 1 < a->count)].value;
        assert_same_at(a, b, value);
        assert_same_at(a, b, value - 1e-9 * (1 + fabs(value)));
        assert_same_at(a, b, (value + next) / 2);
    }
    assert_same_at(a, b, -1e30);
    assert_same_at(a, b, 1e30);
}

static const char *const functions[] = {
    "-400 0.6 0.3 0.2 0\n-50 0.8 0.5 0.4 0.01\n150 0.9 0.6 0.5 0.01\n150 1 0.9 0.8 0.3\n"
    "3000 1 1 0.9 0.9\n",
    "0 0 0 0 0\n0 1 1 1 1\n1 1 0 0 0.5\n",          /* 0 to 1, begins with a step */
    "-1 0 0 0 0\n0.1 0.1 0.2 0.3 0.4\n1 1 1 1 1\n", /* -1 to 1 in data units */
    "5 0.1 0.2 0.3 0.4\n",                          /* one point */
    "1 0 0 0 0\n2 0.1 0 0 0.1\n2 0.9 0 0 0.9\n2 0.2 0 0 0.2\n3 1 1 1 1\n", /* an unused point */
    "1e-300 0 0 0 0\n1e300 1 1 1 1\n",
};
enum { FUNCTIONS = sizeof functions / sizeof *functions };

static void every_format_can_be_read_back(void **state)
{
    (void)state;
    for (int i = 0; i < FUNCTIONS; i++)
        for (int format = TRIP_TF_TEXT; format <= TRIP_TF_VTK; format++) {
            trip_tf *tf = parse(functions[i]), *other = again(tf, (trip_tf_format)format);
            assert_same(tf, other);
            trip_tf_destroy(tf);
            trip_tf_destroy(other);
        }
}

static void all_presets_can_be_written_for_paraview(void **state)
{
    (void)state;
    for (size_t i = 0; trip_tf_preset_name(i); i++) {
        trip_tf *tf, *other;
        assert_int_equal(trip_tf_load(&tf, trip_tf_preset_name(i)), TRIP_OK);
        if (!tf->made) {
            other = again(tf, TRIP_TF_PARAVIEW);
            assert_same(tf, other);
            trip_tf_destroy(other);
        }
        trip_tf_destroy(tf);
    }
}

static void a_normalised_function_keeps_its_range_in_paraview(void **state)
{
    (void)state;
    trip_tf *tf = parse("values normalised\n0.2 0 0 0 0\n0.6 1 1 1 1\n");
    trip_tf *other = again(tf, TRIP_TF_PARAVIEW);
    assert_true(trip_tf_is_normalised(other));
    for (double v = 0; v <= 1; v += 0.05)
        assert_same_at(tf, other, v);
    trip_tf_destroy(tf);
    trip_tf_destroy(other);
}

static void units_of_opacity_are_written_if_the_format_has_them(void **state)
{
    (void)state;
    trip_tf *tf = parse("unit 2.5\n0 0 0 0 0\n9 1 1 1 1\n");
    const trip_tf_format with[] = { TRIP_TF_TEXT, TRIP_TF_VP_JSON, TRIP_TF_SLICER, TRIP_TF_VTK };
    for (int i = 0; i < 4; i++) {
        trip_tf *other = again(tf, with[i]);
        assert_true(trip_tf_unit_world(other) == 2.5);
        trip_tf_destroy(other);
    }
    const trip_tf_format without[] = { TRIP_TF_PARAVIEW, TRIP_TF_VP };
    for (int i = 0; i < 2; i++) {
        test_catch_reports();
        trip_tf *other = again(tf, without[i]);
        assert_one_report("unit of opacity");
        assert_true(trip_tf_unit_world(other) == 0);
        trip_tf_destroy(other);
    }
    trip_tf_destroy(tf);
}

static void formats_in_data_units_refuse_normalised_functions(void **state)
{
    (void)state;
    trip_tf *tf = parse("values normalised\n0 0 0 0 0\n1 1 1 1 1\n");
    const trip_tf_format forms[] = { TRIP_TF_VP, TRIP_TF_VP_JSON, TRIP_TF_SLICER, TRIP_TF_VTK };
    for (int i = 0; i < 4; i++) {
        char *text;
        test_catch_reports();
        assert_int_equal(trip_tf_write(tf, forms[i], "a", &text), TRIP_USAGE);
        assert_one_report("--range LO:HI");
        assert_null(text);
    }
    trip_tf_destroy(tf);
}

static void every_format_can_hold_32768_points(void **state)
{
    (void)state;
    enum { POINTS = 32768 };
    trip_tf_point *points = calloc(POINTS, sizeof *points);
    trip_tf *tf;
    assert_non_null(points);
    for (int i = 0; i < POINTS; i++) {
        double at = (i + 1) / 2 - 0.5, shade = (i / 2) % 7 / 7.0; /* a step every two points */
        points[i] = (trip_tf_point){ at, { shade, 1 - shade, 0.5, shade } };
    }
    assert_int_equal(trip_tf_from_points(&tf, points, POINTS, false, 0), TRIP_OK);
    for (int format = TRIP_TF_TEXT; format <= TRIP_TF_VTK; format++) {
        trip_tf *other = again(tf, (trip_tf_format)format);
        for (double v = 0; v < POINTS / 2; v += 111)
            assert_same_at(tf, other, v);
        trip_tf_destroy(other);
    }
    trip_tf_destroy(tf);
    free(points);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_format_can_be_read_back),
        cmocka_unit_test(all_presets_can_be_written_for_paraview),
        cmocka_unit_test(a_normalised_function_keeps_its_range_in_paraview),
        cmocka_unit_test(units_of_opacity_are_written_if_the_format_has_them),
        cmocka_unit_test(formats_in_data_units_refuse_normalised_functions),
        cmocka_unit_test(every_format_can_hold_32768_points),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
