/* Tests that settings convert to options and back, and which setting of a report is selected. */
#include "fastest.h"
#include "test.h"
#include "draw_settings.h"

static void options_describe_a_setting_completely(void **state)
{
    (void)state;
    accuracy_setting all[ACCURACY_SETTINGS_MAX];
    const draw_settings defaults = { 0 };
    int count = accuracy_settings(all, &defaults);
    assert_true(count > 40 && count <= ACCURACY_SETTINGS_MAX);
    for (int i = 0; i < count; i++) {
        accuracy_option options[ACCURACY_OPTIONS_MAX];
        accuracy_setting again = { .settings = defaults };
        int n = accuracy_setting_options(&all[i], options);
        for (int k = 0; k < n; k++)
            assert_true(accuracy_setting_read_option(&again, options[k].name, options[k].value));
        if (all[i].renderer == TRIPTYCH_RENDERER_INTEGRAL) /* the integral ignores `classify` */
            again.settings.all.classify = all[i].settings.all.classify;
        assert_int_equal(again.renderer, all[i].renderer);
        assert_memory_equal(&again.settings, &all[i].settings, sizeof defaults);
    }
}

static void unknown_options_are_refused(void **state)
{
    (void)state;
    static const char *const pairs[][2] = { { "h", "much" },
                                            { "h", "" },
                                            { "samples-per-sheet", "1.5" },
                                            { "samples-per-sheet", "-1" },
                                            { "samples", "1e9" },
                                            { "classify", "late" },
                                            { "sharpness", "1" },
                                            { "method", "" },
                                            { "renderer", "cpu " } };
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        accuracy_setting s = { .settings = (draw_settings){ .has_background = 0 } };
        assert_false(accuracy_setting_read_option(&s, pairs[i][0], pairs[i][1]));
    }
}

#define ROW_OF(data_set, name, ms, error, options)                                                 \
    "{\"name\":\"" name "\",\"data_set\":\"" data_set "\",\"ms\":" ms ",\"error\":" error          \
    ",\"options\":{" options "}}"
#define ROW(name, ms, error, options) ROW_OF("a.trip", name, ms, error, options)
#define REPORT(rows)                                                                               \
    "{\"triptych_accuracy\":3,\"data_set\":\"a.trip\",\"transfer_function\":null,"                 \
    "\"shading\":true,\"rows\":[" rows "]}"

#define OF_REFERENCE "\"renderer\":\"reference\",\"classify\":\"post\""
#define OF_CPU "\"renderer\":\"cpu\",\"samples-per-sheet\":\"4\""
#define OF_GL "\"renderer\":\"gl\",\"samples-per-sheet\":\"1\""
#define OF_NO_VERSION "\"renderer\":\"cpu\",\"sharpness\":\"1\""

/* clang-format off */
static const char report[] = REPORT(
    ROW("slow", "90", "0.1", OF_REFERENCE) ","
    ROW("fine", "40", "0.5", OF_CPU) ","
    ROW("quick", "10", "2", OF_GL) ","
    ROW("odd", "1", "0", OF_NO_VERSION) ","
    ROW_OF("b.trip", "other", "1", "0", ""));
/* clang-format on */

static const struct {
    double error;
    unsigned renderers;
    const char *name; /* NULL if no setting qualifies */
} choices[] = {
    { 3, 0, "quick" },
    { 2, 0, "quick" }, /* the error may equal the bound */
    { 1.99, 0, "fine" },
    { 0.5, 0, "fine" },
    { 0.49, 0, "slow" },
    { 3, 1u << TRIPTYCH_RENDERER_CPU, "fine" },
    { 0.49, 1u << TRIPTYCH_RENDERER_CPU, NULL },
    { 0.05, 0, NULL },
    { 3, 1u << TRIPTYCH_RENDERER_INTEGRAL, NULL },
};

static void the_fastest_setting_within_the_error_is_selected(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof choices / sizeof *choices; i++) {
        accuracy_found found = { .setting.settings = (draw_settings){ .has_background = 0 } };
        const accuracy_wanted wanted = { .error = choices[i].error,
                                         .renderers = choices[i].renderers };
        found.setting.settings.background[0] = 0.25;
        test_catch_reports();
        int status = accuracy_fastest_in(report, "a.json", &wanted, &found);
        if (!choices[i].name) {
            assert_int_equal(status, TRIP_ERROR);
            assert_one_report("a.json");
            continue;
        }
        assert_int_equal(status, 0);
        assert_string_equal(found.setting.name, choices[i].name);
        assert_true(found.setting.settings.background[0] == 0.25);
    }
}

static void invalid_reports_are_refused(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "",          "x",
        "{}",        "[]",
        REPORT("1"), "{\"triptych_accuracy\":2,\"rows\":[]}",
        REPORT(""),  REPORT("{\"name\":\"a\",\"data_set\":\"a.trip\"}")
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        accuracy_found found = { .setting.settings = (draw_settings){ .has_background = 0 } };
        test_catch_reports();
        assert_int_equal(
            accuracy_fastest_in(texts[i], "a.json", &(accuracy_wanted){ .error = 9 }, &found),
            TRIP_ERROR);
        assert_one_report("a.json");
    }
}

static void a_report_of_another_data_set_is_refused(void **state)
{
    (void)state;
    static const char row[] = "\"rows\":[{\"name\":\"a\",\"data_set\":\"a.trip\",\"ms\":1,"
                              "\"error\":1,\"options\":{}}]}";
    const struct {
        const char *checksum, *wanted;
        int status, reports;
    } cases[] = { { "\"checksum\":\"00000000000000ff\",", "00000000000000ff", 0, 0 },
                  { "\"checksum\":\"00000000000000fe\",", "00000000000000ff", TRIP_ERROR, 1 },
                  { "\"checksum\":\"00000000000000fe\",", NULL, 0, 0 },
                  { "", "00000000000000ff", 0, 1 } };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[512];
        accuracy_found found = { .setting.settings = (draw_settings){ .has_background = 0 } };
        snprintf(text, sizeof text,
                 "{\"triptych_accuracy\":3,\"data_set\":\"a.trip\",\"shading\":true,%s%s",
                 cases[i].checksum, row);
        test_catch_reports();
        int status = accuracy_fastest_in(
            text, "a.json", &(accuracy_wanted){ .error = 9, .checksum = cases[i].wanted }, &found);
        assert_int_equal(status, cases[i].status);
        assert_int_equal(test_report_count, cases[i].reports);
    }
    char own[ACCURACY_CHECKSUM_BYTES];
    accuracy_checksum_text(255, own);
    assert_string_equal(own, cases[0].wanted);
}

static void a_report_names_the_levels_of_its_data_set(void **state)
{
    (void)state;
    const struct {
        const char *text;
        bool says;
        triptych_levels_for levels_for;
    } cases[] = { { "\"levels_for\":\"auto\",", true, TRIPTYCH_LEVELS_FOR_AUTO },
                  { "\"levels_for\":\"both\",", true, TRIPTYCH_LEVELS_FOR_BOTH },
                  { "\"levels_for\":\"all\",", false, TRIPTYCH_LEVELS_FOR_AUTO },
                  { "\"levels_for\":3,", false, TRIPTYCH_LEVELS_FOR_AUTO },
                  { "", false, TRIPTYCH_LEVELS_FOR_AUTO } };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[512];
        accuracy_found found = { .setting.settings = (draw_settings){ .has_background = 0 } };
        snprintf(
            text, sizeof text,
            "{\"triptych_accuracy\":3,\"data_set\":\"a.trip\",\"shading\":true,%s\"rows\":[" ROW(
                "a", "1", "1", "") "]}",
            cases[i].text);
        assert_int_equal(
            accuracy_fastest_in(text, "a.json", &(accuracy_wanted){ .error = 9 }, &found), 0);
        assert_int_equal(found.says_levels, cases[i].says);
        assert_int_equal(found.levels_for, cases[i].levels_for);
    }
}

static void a_report_is_found_beside_the_data(void **state)
{
    (void)state;
    static const char *const pairs[][2] = { { "a.trip", "a.accuracy" },
                                            { "b/a.trip//", "b/a.accuracy" },
                                            { "../a.nii", "../a.accuracy" },
                                            { "a.b/c", "a.b/c.accuracy" },
                                            { ".trip", ".trip.accuracy" } };
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        char *path = accuracy_report_path(pairs[i][0]);
        assert_string_equal(path, pairs[i][1]);
        free(path);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(options_describe_a_setting_completely),
        cmocka_unit_test(unknown_options_are_refused),
        cmocka_unit_test(the_fastest_setting_within_the_error_is_selected),
        cmocka_unit_test(invalid_reports_are_refused),
        cmocka_unit_test(a_report_of_another_data_set_is_refused),
        cmocka_unit_test(a_report_names_the_levels_of_its_data_set),
        cmocka_unit_test(a_report_is_found_beside_the_data),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
