#include "test.h"

#include "tf_internal.h"

static trip_tf *from_xml(const char *text, const char *name)
{
    trip_tf *tf;
    assert_int_equal(trip_tf_parse_any(&tf, "m.xml", text, strlen(text), name), TRIP_OK);
    return tf;
}

static void assert_refused(const char *text, const char *name, const char *report)
{
    trip_tf *tf;
    test_catch_reports();
    assert_int_equal(trip_tf_parse_any(&tf, "m.xml", text, strlen(text), name), TRIP_ERROR);
    assert_one_report(report);
    assert_null(tf);
}

static void assert_rgba(trip_rgba c, double r, double g, double b, double opacity)
{
    assert_close(c.r, r, 1e-9);
    assert_close(c.g, g, 1e-9);
    assert_close(c.b, b, 1e-9);
    assert_close(c.opacity, opacity, 1e-9);
}

/* Two presets in the form of Slicer's presets.xml. */
static const char slicer[] =
    "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<MRML>\n"
    "<VolumeProperty name=\"One\" gradientOpacity=\"4 0 1 255 1\" specularPower=\"10\"\n"
    " scalarOpacity=\"8 -3024 0 -16.5 0 641.5 0.7 3071 0.5\" id=\"vtkMRMLVolumePropertyNode3\"\n"
    " colorTransfer=\"12 -3024 0 0 0 641.5 0.9 0.8 0.6 3071 1 1 1\" shade=\"1\"/>\n"
    "<VolumeProperty name=\"Two &lt;&amp;\" scalarOpacity=\"4 0 0 10 1\"\n"
    " colorTransfer=\"8 0 1 0 0 10 0 1 0\" scalarOpacityUnitDistance=\"2.5\"/>\n</MRML>\n";

static void presets_of_slicer_have_numbers_in_attributes(void **state)
{
    (void)state;
    trip_tf *tf = from_xml(slicer, NULL);
    assert_false(trip_tf_is_normalised(tf));
    assert_true(trip_tf_unit_world(tf) == 0);
    assert_rgba(trip_tf_evaluate(tf, -4000), 0, 0, 0, 0);
    assert_rgba(trip_tf_evaluate(tf, 641.5), 0.9, 0.8, 0.6, 0.7);
    assert_rgba(trip_tf_evaluate(tf, (641.5 + 3071) / 2), 0.95, 0.9, 0.8, 0.6);
    assert_false(trip_tf_visible_in(tf, -3000, -16.5));
    trip_tf_destroy(tf);
}

static void a_preset_is_selected_by_its_name(void **state)
{
    (void)state;
    trip_tf *tf = from_xml(slicer, "Two <&");
    assert_true(trip_tf_unit_world(tf) == 2.5);
    assert_rgba(trip_tf_evaluate(tf, 5), 0.5, 0.5, 0, 0.5);
    trip_tf_destroy(tf);
    assert_refused(slicer, "Three", "m.xml: holds no function named `Three`");
}

/* The text has the form of vtkXMLVolumePropertyWriter. Only its first component is read. */
static void properties_of_vtk_have_points_as_elements(void **state)
{
    (void)state;
    trip_tf *tf = from_xml(
        "<VolumeProperty Version=\"1.13\" InterpolationType=\"1\" IndependentComponents=\"1\">\n"
        "<Component Index=\"0\" Shade=\"0\" ColorChannels=\"3\" "
        "ScalarOpacityUnitDistance=\"0.5\">\n"
        "<RGBTransferFunction><ColorTransferFunction Size=\"2\" Clamping=\"1\" ColorSpace=\"0\">\n"
        "<Point X=\"100\" Value=\"0 0 1\"/><Point X=\"300\" Value=\"1 0 0\"/>\n"
        "</ColorTransferFunction></RGBTransferFunction>\n"
        "<ScalarOpacity><PiecewiseFunction Size=\"2\" Clamping=\"1\">\n"
        "<Point X=\"100\" Value=\"0\" MidPoint=\"0.25\" Sharpness=\"1\"/>"
        "<Point X=\"300\" Value=\"0.8\"/>\n"
        "</PiecewiseFunction></ScalarOpacity></Component>\n"
        "<Component Index=\"1\" ScalarOpacityUnitDistance=\"7\"><ScalarOpacity>"
        "<PiecewiseFunction><Point X=\"0\" Value=\"1\"/></PiecewiseFunction></ScalarOpacity>"
        "</Component></VolumeProperty>",
        NULL);
    assert_true(trip_tf_unit_world(tf) == 0.5);
    assert_rgba(trip_tf_evaluate(tf, 200), 0.5, 0, 0.5, 0.8);
    assert_rgba(trip_tf_evaluate(tf, 149), 0.245, 0, 0.755, 0); /* a step at 150 */
    assert_rgba(trip_tf_evaluate(tf, 151), 0.255, 0, 0.745, 0.8);
    trip_tf_destroy(tf);
}

static void grey_transfer_functions_are_read(void **state)
{
    (void)state;
    trip_tf *tf = from_xml("<VolumeProperty><Component Index=\"0\"><GrayTransferFunction>"
                           "<PiecewiseFunction><Point X=\"0\" Value=\"0\"/><Point X=\"4\" "
                           "Value=\"1\"/></PiecewiseFunction></GrayTransferFunction>"
                           "<ScalarOpacity><PiecewiseFunction><Point X=\"0\" Value=\"0.5\"/>"
                           "</PiecewiseFunction></ScalarOpacity></Component></VolumeProperty>",
                           NULL);
    assert_rgba(trip_tf_evaluate(tf, 1), 0.25, 0.25, 0.25, 0.5);
    trip_tf_destroy(tf);
}

static void colour_maps_of_older_paraview_versions_are_normalised(void **state)
{
    (void)state;
    trip_tf *tf = from_xml("<ColorMaps><ColorMap name=\"a\" space=\"RGB\">"
                           "<Point x=\"-1\" o=\"0\" r=\"0\" g=\"0\" b=\"0\"/>"
                           "<Point x=\"1\" o=\"1\" r=\"1\" g=\"0.5\" b=\"0\"/>"
                           "<NaN r=\"1\" g=\"0\" b=\"0\"/></ColorMap></ColorMaps>",
                           NULL);
    assert_true(trip_tf_is_normalised(tf));
    trip_tf_denormalise(tf, 100, 200);
    assert_rgba(trip_tf_evaluate(tf, 150), 0.5, 0.25, 0, 0.5);
    trip_tf_destroy(tf);
}

/* All their points have o="1". */
static void colour_maps_for_surfaces_get_a_ramp(void **state)
{
    (void)state;
    trip_tf *tf = from_xml("<ColorMap name=\"a\" space=\"RGB\">"
                           "<Point x=\"0\" o=\"1\" r=\"0\" g=\"0\" b=\"0\"/>"
                           "<Point x=\"1\" o=\"1\" r=\"1\" g=\"0.5\" b=\"0\"/></ColorMap>",
                           NULL);
    trip_tf_denormalise(tf, 100, 200);
    assert_rgba(trip_tf_evaluate(tf, 100), 0, 0, 0, 0);
    assert_rgba(trip_tf_evaluate(tf, 150), 0.5, 0.25, 0, 0.5);
    trip_tf_destroy(tf);
}

static void opacity_by_gradient_gives_a_warning(void **state)
{
    (void)state;
    trip_tf *tf;
    static const char text[] = "<VolumeProperty scalarOpacity=\"2 0 1\" colorTransfer=\"4 0 1 1 1\""
                               " gradientOpacity=\"4 0 0 255 1\"/>";
    test_catch_reports();
    assert_int_equal(trip_tf_parse_any(&tf, "m.xml", text, strlen(text), NULL), TRIP_OK);
    assert_one_report("opacity by gradient is ignored");
    trip_tf_destroy(tf);
}

static void every_report_names_the_fault(void **state)
{
    (void)state;
    static const char *const bad[][2] = {
        { "<MRML>\n<VolumeProperty", "m.xml: line 2: not XML" },
        { "<MRML/>", "holds no volume property" },
        { "<VolumeProperty scalarOpacity=\"2 0 1\"/>", "no colorTransfer" },
        { "<VolumeProperty colorTransfer=\"4 0 1 1 1\"/>", "no scalarOpacity" },
        { "<VolumeProperty scalarOpacity=\"3 0 1 0\" colorTransfer=\"0\"/>", "multiple of 2" },
        { "<VolumeProperty scalarOpacity=\"4 0 1\" colorTransfer=\"0\"/>", "not finite" },
        { "<VolumeProperty scalarOpacity=\"2 0 1 3 4\" colorTransfer=\"0\"/>", "more numbers" },
        { "<VolumeProperty scalarOpacity=\"4 1 1 0 1\" colorTransfer=\"0\"/>", "decrease" },
        { "<VolumeProperty scalarOpacity=\"2 0 2\" colorTransfer=\"0\"/>", "outside 0 to 1" },
        { "<VolumeProperty scalarOpacity=\"1e99 0 1\" colorTransfer=\"0\"/>", "number of numbers" },
        { "<VolumeProperty scalarOpacity=\"2 0 1\" colorTransfer=\"0\"/>", "no colours" },
        { "<VolumeProperty><Component Index=\"0\" ScalarOpacityUnitDistance=\"-1\"/>"
          "</VolumeProperty>",
          "not a positive length" },
        { "<VolumeProperty><Component Index=\"0\"><ScalarOpacity><Point X=\"nan\" Value=\"1\"/>"
          "</ScalarOpacity></Component></VolumeProperty>",
          "not finite" },
        { "<!DOCTYPE MRML><MRML/>", "document type declaration" },
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_refused(bad[i][0], NULL, bad[i][1]);
}

/* The first text has nested entities that multiply ("billion laughs"), the second names a file. */
static void entities_are_never_expanded(void **state)
{
    (void)state;
    assert_refused("<!DOCTYPE m [<!ENTITY a \"ha\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;\">"
                   "<!ENTITY c \"&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;\">]><MRML>&c;</MRML>",
                   NULL, "document type declaration");
    assert_refused("<!DOCTYPE m [<!ENTITY a SYSTEM \"file:///etc/passwd\">]><MRML>&a;</MRML>", NULL,
                   "document type declaration");
    assert_refused("<MRML>&a;</MRML>", NULL, "not XML");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(presets_of_slicer_have_numbers_in_attributes),
        cmocka_unit_test(a_preset_is_selected_by_its_name),
        cmocka_unit_test(properties_of_vtk_have_points_as_elements),
        cmocka_unit_test(grey_transfer_functions_are_read),
        cmocka_unit_test(colour_maps_of_older_paraview_versions_are_normalised),
        cmocka_unit_test(colour_maps_for_surfaces_get_a_ramp),
        cmocka_unit_test(opacity_by_gradient_gives_a_warning),
        cmocka_unit_test(every_report_names_the_fault),
        cmocka_unit_test(entities_are_never_expanded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
