#include "test.h"

#include "tf_internal.h"

static trip_tf *from_json(const char *text)
{
    trip_tf *tf;
    assert_int_equal(trip_tf_parse_colormap(&tf, "m.json", text, strlen(text), NULL), TRIP_OK);
    return tf;
}

static void assert_refused(const char *text, const char *report)
{
    trip_tf *tf;
    test_catch_reports();
    assert_int_equal(trip_tf_parse_colormap(&tf, "m.json", text, strlen(text), NULL), TRIP_ERROR);
    assert_one_report(report);
    assert_null(tf);
}

static void assert_rgba(trip_rgba c, double r, double g, double b, double opacity)
{
    assert_close(c.r, r, 1e-6);
    assert_close(c.g, g, 1e-6);
    assert_close(c.b, b, 1e-6);
    assert_close(c.opacity, opacity, 1e-6);
}

static void points_of_colours_and_of_opacities_are_merged(void **state)
{
    (void)state;
    trip_tf *tf = from_json("{\"ColorSpace\":\"RGB\",\"RGBPoints\":[0,0,0,0, 100,1,0,0, 200,1,1,0],"
                            "\"Points\":[50,0,0.5,0, 150,0.5,0.5,0, 250,1,0.5,0]}");
    assert_false(trip_tf_is_normalised(tf));
    assert_true(trip_tf_unit_world(tf) == 0);
    assert_rgba(trip_tf_evaluate(tf, 0), 0, 0, 0, 0);
    assert_rgba(trip_tf_evaluate(tf, 50), 0.5, 0, 0, 0);
    assert_rgba(trip_tf_evaluate(tf, 100), 1, 0, 0, 0.25);
    assert_rgba(trip_tf_evaluate(tf, 150), 1, 0.5, 0, 0.5);
    assert_rgba(trip_tf_evaluate(tf, 175), 1, 0.75, 0, 0.625);
    assert_rgba(trip_tf_evaluate(tf, 250), 1, 1, 0, 1);
    assert_false(trip_tf_visible_in(tf, -10, 50));
    trip_tf_destroy(tf);
}

static void a_map_without_opacities_gets_a_ramp(void **state)
{
    (void)state;
    trip_tf *tf = from_json("[{\"RGBPoints\":[100,0,0,1, 300,1,0,0]}]");
    assert_rgba(trip_tf_evaluate(tf, 100), 0, 0, 1, 0);
    assert_rgba(trip_tf_evaluate(tf, 150), 0.25, 0, 0.75, 0.25);
    assert_rgba(trip_tf_evaluate(tf, 300), 1, 0, 0, 1);
    trip_tf_destroy(tf);
}

static void maps_over_generic_ranges_are_normalised(void **state)
{
    (void)state;
    trip_tf *tf = from_json("{\"RGBPoints\":[-1,0,0,0, 0,1,0,0, 1,1,1,1],"
                            "\"Points\":[0,0,0.5,0, 1,0.5,0.5,0]}");
    assert_true(trip_tf_is_normalised(tf));
    trip_tf_denormalise(tf, 0, 200);
    assert_rgba(trip_tf_evaluate(tf, 100), 1, 0, 0, 0.25);
    trip_tf_destroy(tf);
    tf = from_json("{\"RGBPoints\":[0,0,0,0, 1,1,1,1]}");
    assert_true(trip_tf_is_normalised(tf));
    trip_tf_destroy(tf);
    tf = from_json("{\"RGBPoints\":[0,0,0,0, 2,1,1,1]}");
    assert_false(trip_tf_is_normalised(tf));
    trip_tf_destroy(tf);
}

/* The expected values are from vtkPiecewiseFunction of VTK 9.1, after AddPoint(0, 0.1, midpoint,
 * sharpness) and AddPoint(2, 0.9). */
static void midpoint_and_sharpness_bend_opacity_as_in_vtk(void **state)
{
    (void)state;
    static const double at[5] = { 0.2, 0.5, 1.0, 1.3, 1.8 };
    static const struct {
        double midpoint, sharpness, expected[5];
    } cases[] = {
        { 0.5, 0, { 0.18, 0.3, 0.5, 0.62, 0.82 } },
        { 0.3, 0, { 0.233333333, 0.433333333, 0.614285714, 0.7, 0.842857143 } },
        { 0.5, 0.5, { 0.100012801, 0.103197861, 0.5, 0.872480655, 0.899987199 } },
        { 0.3, 0.25, { 0.106483101, 0.292975096, 0.794830995, 0.872346147, 0.899669237 } },
        { 0.7, 0.9, { 0.1, 0.100001351, 0.102020833, 0.222236734, 0.899999322 } },
        { 0.3, 1, { 0.1, 0.1, 0.9, 0.9, 0.9 } },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[256];
        snprintf(text, sizeof text,
                 "{\"RGBPoints\":[0,0,0,0,2,1,1,1],\"Points\":[0,0.1,%g,%g,2,0.9,0.5,0]}",
                 cases[i].midpoint, cases[i].sharpness);
        trip_tf *tf = from_json(text);
        for (int k = 0; k < 5; k++) /* bent curves are sampled */
            assert_close(trip_tf_evaluate(tf, at[k]).opacity, cases[i].expected[k], 2e-4);
        trip_tf_destroy(tf);
    }
}

static void a_sharp_step_is_invisible_below_its_midpoint(void **state)
{
    (void)state;
    trip_tf *tf = from_json("{\"RGBPoints\":[0,0,0,0,100,1,1,1],"
                            "\"Points\":[0,0,0.25,1, 100,1,0.5,0]}");
    assert_false(trip_tf_visible_in(tf, 0, nextafter(25, 0)));
    assert_true(trip_tf_visible_in(tf, 25, 25));
    assert_true(trip_tf_evaluate(tf, 25).opacity == 1);
    trip_tf_destroy(tf);
}

/* The expected values are from GetColor(30.1) of vtkColorTransferFunction of VTK 9.1, with these
 * points in each space. */
static void colour_spaces_are_sampled_finely_enough(void **state)
{
    (void)state;
    static const struct {
        const char *space;
        double expected[3];
    } cases[] = {
        { "RGB", { 0.37147, 0.21271, 0.5694 } },
        { "HSV", { 0.417295226, 0.160704167, 0.73495 } },
        { "Lab", { 0.491837091, 0.244564806, 0.561743586 } },
        { "Diverging", { 0.615952937, 0.747390492, 0.996249596 } },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[256];
        snprintf(text, sizeof text,
                 "{\"ColorSpace\":\"%s\",\"RGBPoints\":[0,0.23,0.3,0.75,100,0.7,0.01,0.15]}",
                 cases[i].space);
        trip_tf *tf = from_json(text);
        trip_rgba c = trip_tf_evaluate(tf, 30.1);
        assert_close(c.r, cases[i].expected[0], 1e-4);
        assert_close(c.g, cases[i].expected[1], 1e-4);
        assert_close(c.b, cases[i].expected[2], 1e-4);
        trip_tf_destroy(tf);
    }
}

static void the_step_space_has_one_colour_between_two_points(void **state)
{
    (void)state;
    trip_tf *tf = from_json("{\"ColorSpace\":\"Step\",\"RGBPoints\":[0,1,0,0, 10,0,1,0, 20,0,0,1],"
                            "\"Points\":[0,0.5,0.5,0]}");
    assert_rgba(trip_tf_evaluate(tf, -1), 1, 0, 0, 0.5);
    assert_rgba(trip_tf_evaluate(tf, 0.001), 0, 1, 0, 0.5);
    assert_rgba(trip_tf_evaluate(tf, 9.999), 0, 1, 0, 0.5);
    assert_rgba(trip_tf_evaluate(tf, 10.001), 0, 0, 1, 0.5);
    assert_rgba(trip_tf_evaluate(tf, 30), 0, 0, 1, 0.5);
    trip_tf_destroy(tf);
}

static void the_first_or_the_named_map_is_read(void **state)
{
    (void)state;
    static const char text[] = "[7, {\"Name\":\"a\",\"RGBPoints\":[5,1,0,0]},"
                               "{\"Name\":\"b\",\"RGBPoints\":[5,0,1,0]}]";
    trip_tf *tf = from_json(text);
    assert_true(trip_tf_evaluate(tf, 5).r == 1);
    trip_tf_destroy(tf);
    assert_int_equal(trip_tf_parse_colormap(&tf, "m.json", text, sizeof text - 1, "b"), TRIP_OK);
    assert_true(trip_tf_evaluate(tf, 5).g == 1);
    trip_tf_destroy(tf);
}

static void rounding_errors_of_exports_are_accepted(void **state)
{
    (void)state;
    trip_tf *tf = from_json("{\"RGBPoints\":[5,1.0000001,-1e-8,0]}");
    assert_true(trip_tf_evaluate(tf, 5).r == 1);
    assert_true(trip_tf_evaluate(tf, 5).g == 0);
    trip_tf_destroy(tf);
}

static void unsupported_features_give_a_warning(void **state)
{
    (void)state;
    test_catch_reports();
    trip_tf *tf =
        from_json("{\"Name\":\"n\",\"ColorSpace\":\"Lab/CIEDE2000\",\"RGBPoints\":[5,1,0,0]}");
    assert_one_report("warning: m.json: n: colour space Lab/CIEDE2000 is drawn as Lab");
    trip_tf_destroy(tf);
    test_catch_reports();
    tf = from_json("{\"UseLogScale\":1,\"RGBPoints\":[5,1,0,0]}");
    assert_one_report("UseLogScale");
    trip_tf_destroy(tf);
}

static void invalid_maps_are_refused_with_their_name(void **state)
{
    (void)state;
    assert_refused("[{\"Name\":\"n\",\"RGBPoints\":[0,0,0]}]", "m.json: n: RGBPoints is not");
    assert_refused("[{\"RGBPoints\":[]}]", "RGBPoints is not");
    assert_refused("[{\"RGBPoints\":5}]", "RGBPoints is not");
    assert_refused("[{\"RGBPoints\":[0,0,0,\"1\"]}]", "point 1 has a number outside 0 to 1");
    assert_refused("[{\"RGBPoints\":[null,0,0,1]}]", "a value is not finite");
    assert_refused("[{\"RGBPoints\":[0,0,0,1,-1,0,0,0]}]", "values decrease at point 2");
    assert_refused("[{\"RGBPoints\":[0,0,0,255]}]", "point 1 has a number outside 0 to 1");
    assert_refused("[{\"RGBPoints\":[0,0,0,1],\"Points\":[0,1,0.5]}]", "Points is not");
    assert_refused("[{\"RGBPoints\":[0,0,0,1],\"Points\":[0,1,7,0]}]", "Points: point 1");
    assert_refused("[{\"ColorSpace\":\"XYZ\",\"RGBPoints\":[0,0,0,1]}]",
                   "unknown ColorSpace `XYZ`");
    assert_refused("[{\"IndexedColors\":[1,0,0]}]", "maps of categories");
    assert_refused("[]", "m.json: holds no colour map");
    assert_refused("[1, [2]]", "m.json: holds no colour map");
}

static void the_report_of_invalid_json_names_the_line(void **state)
{
    (void)state;
    assert_refused("[\n{\"RGBPoints\":\n[0,0,,", "m.json: line 3: not JSON");
    assert_refused("", "m.json: line 1: not JSON");
    assert_refused("{\"RGBPoints\":[0,0,0,1]}\n{}", "m.json: line 2: not JSON");
}

static void deep_nesting_is_refused(void **state)
{
    (void)state;
    enum { DEPTH = 100000 };
    char *text = malloc(DEPTH + 1);
    assert_non_null(text);
    memset(text, '[', DEPTH);
    text[DEPTH] = 0;
    assert_refused(text, "not JSON");
    free(text);
}

static void too_many_points_are_refused(void **state)
{
    (void)state;
    enum { POINTS = 65537 };
    char *text = malloc(POINTS * 8 + 64), *p = text;
    assert_non_null(text);
    p += sprintf(p, "{\"RGBPoints\":[");
    for (int i = 0; i < POINTS; i++)
        p += sprintf(p, "%s5,0,0,0", i ? "," : "");
    strcpy(p, "]}");
    assert_refused(text, "RGBPoints: more than 65536 points");
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_of_colours_and_of_opacities_are_merged),
        cmocka_unit_test(a_map_without_opacities_gets_a_ramp),
        cmocka_unit_test(maps_over_generic_ranges_are_normalised),
        cmocka_unit_test(midpoint_and_sharpness_bend_opacity_as_in_vtk),
        cmocka_unit_test(a_sharp_step_is_invisible_below_its_midpoint),
        cmocka_unit_test(colour_spaces_are_sampled_finely_enough),
        cmocka_unit_test(the_step_space_has_one_colour_between_two_points),
        cmocka_unit_test(the_first_or_the_named_map_is_read),
        cmocka_unit_test(rounding_errors_of_exports_are_accepted),
        cmocka_unit_test(unsupported_features_give_a_warning),
        cmocka_unit_test(invalid_maps_are_refused_with_their_name),
        cmocka_unit_test(the_report_of_invalid_json_names_the_line),
        cmocka_unit_test(deep_nesting_is_refused),
        cmocka_unit_test(too_many_points_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
