#include "test.h"

#include "tf_internal.h"

/* The example is from Slicer's documentation of the format. */
#define HEAD "1\n1\n0.9\n0.1\n0.2\n10\n"
#define OPACITY                                                                                    \
    "14 -3024 0 -86.9767 0 45.3791 0.169643 139.919 0.589286 347.907 0.607143 1224.16 "            \
    "0.607143 3071 0.616071\n"
#define COLOUR                                                                                     \
    "28 -3024 0 0 0 -86.9767 0 0.25098 1 45.3791 1 0 0 139.919 1 0.894893 0.894893 "               \
    "347.907 1 1 0.25098 1224.16 1 1 1 3071 0.827451 0.658824 1\n"

static void nine_lines_are_a_transfer_function(void **state)
{
    (void)state;
    trip_tf *tf;
    static const char text[] = HEAD OPACITY "4 0 1 255 1\n" COLOUR;
    assert_int_equal(trip_tf_parse_any(&tf, "a.vp", text, strlen(text), NULL), TRIP_OK);
    trip_rgba c = trip_tf_evaluate(tf, 45.3791);
    assert_close(c.r, 1, 1e-9);
    assert_close(c.g, 0, 1e-9);
    assert_close(c.opacity, 0.169643, 1e-9);
    c = trip_tf_evaluate(tf, (139.919 + 347.907) / 2);
    assert_close(c.b, (0.894893 + 0.25098) / 2, 1e-9);
    assert_close(c.opacity, (0.589286 + 0.607143) / 2, 1e-9);
    assert_false(trip_tf_is_normalised(tf));
    trip_tf_destroy(tf);
}

static void lines_may_end_in_crlf_and_gradients_may_be_absent(void **state)
{
    (void)state;
    trip_tf *tf;
    static const char text[] = "1\r\n1\r\n0.9\r\n0.1\r\n0.2\r\n10\r\n4 0 0 10 1\r\n\r\n"
                               "4 0 1 1 1\r\n";
    assert_int_equal(trip_tf_parse_any(&tf, "a.vp", text, strlen(text), NULL), TRIP_OK);
    assert_close(trip_tf_evaluate(tf, 5).opacity, 0.5, 1e-12);
    trip_tf_destroy(tf);
}

static void every_report_names_the_line(void **state)
{
    (void)state;
    static const char *const bad[][2] = {
        { HEAD OPACITY, "fewer than 9 lines" },
        { HEAD "4 0 0 1\n\n4 0 1 1 1\n", "opacities (line 7)" },
        { HEAD "4 0 0 1 1\nx\n4 0 1 1 1\n", "gradient opacities (line 8)" },
        { HEAD "4 0 0 1 1\n\n3 0 1 1\n", "colours (line 9)" },
        { HEAD "4 0 0 1 1\n\n4 0 1 1 7\n", "outside 0 to 1" },
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        trip_tf *tf;
        test_catch_reports();
        assert_int_equal(trip_tf_parse_any(&tf, "a.vp", bad[i][0], strlen(bad[i][0]), NULL),
                         TRIP_ERROR);
        assert_one_report(bad[i][1]);
        assert_null(tf);
    }
    trip_tf *tf;
    test_catch_reports();
    assert_int_equal(trip_tf_parse_any(&tf, "a.vp", HEAD "\0\n", sizeof HEAD + 1, NULL),
                     TRIP_ERROR);
    assert_one_report("zero byte");
}

static void the_json_format_has_a_unit_of_opacity(void **state)
{
    (void)state;
    trip_tf *tf;
    static const char text[] =
        "{\"@schema\": \"x\", \"volumeProperties\": [{\"components\": [{\"shade\": true,"
        "\"rgbTransferFunction\": {\"type\": \"colorTransferFunction\", \"points\": ["
        "{\"x\": 0, \"color\": [0, 0, 0]}, {\"x\": 40, \"color\": [0.4, 0.2, 0.1]},"
        "{\"x\": 40, \"color\": [0.8, 0.2, 0.1]}]}, \"scalarOpacityUnitDistance\": 3.5,"
        "\"scalarOpacity\": {\"points\": [{\"x\": 0, \"y\": 0}, {\"x\": 80, \"y\": 0.8}]}}]}]}";
    assert_int_equal(trip_tf_parse_any(&tf, "a.vp.json", text, strlen(text), NULL), TRIP_OK);
    assert_true(trip_tf_unit_world(tf) == 3.5);
    assert_close(trip_tf_evaluate(tf, 20).r, 0.2, 1e-12);
    assert_close(trip_tf_evaluate(tf, 20).opacity, 0.2, 1e-12);
    assert_close(trip_tf_evaluate(tf, 40).r, 0.8, 1e-12); /* a step */
    trip_tf_destroy(tf);
    static const char *const bad[] = {
        "{\"volumeProperties\": []}",
        "{\"volumeProperties\": 1}",
        "{\"volumeProperties\": [{\"components\": []}]}",
        "{\"volumeProperties\": [{\"components\": [{\"scalarOpacityUnitDistance\": 0}]}]}",
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        test_catch_reports();
        assert_int_equal(trip_tf_parse_any(&tf, "a.vp.json", bad[i], strlen(bad[i]), NULL),
                         TRIP_ERROR);
        assert_one_report("a.vp.json: ");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nine_lines_are_a_transfer_function),
        cmocka_unit_test(lines_may_end_in_crlf_and_gradients_may_be_absent),
        cmocka_unit_test(every_report_names_the_line),
        cmocka_unit_test(the_json_format_has_a_unit_of_opacity),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
