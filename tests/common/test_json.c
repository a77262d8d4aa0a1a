#include "test.h"

#include <cjson/cJSON.h>

#include "json.h"

static void memory_is_charged_before_it_is_allocated(void **state)
{
    (void)state;
    trip_budget *budget;
    trip_json j;
    char text[4096] = "[1";
    for (int i = 0; i < 1000; i++)
        strcat(text, ",1");
    strcat(text, "]");
    assert_int_equal(trip_budget_create(&budget, (uint64_t)1 << 20), 0);
    assert_int_equal(trip_json_parse(&j, text, "a.trip", budget), 0);
    assert_int_equal(cJSON_GetArraySize(j.root), 1001);
    /* Each number takes a node, which is larger than the structure cJSON. */
    assert_true(j.bytes >= 1001 * sizeof(cJSON));
    assert_int_equal(trip_budget_left_bytes(budget), ((uint64_t)1 << 20) - j.bytes);
    trip_json_free(&j);
    assert_int_equal(trip_budget_left_bytes(budget), (uint64_t)1 << 20);
    assert_true(trip_budget_charge(budget, ((uint64_t)1 << 20) - 1000));
    test_catch_reports();
    assert_int_equal(trip_json_parse(&j, text, "a.trip", budget), TRIP_ERROR);
    assert_one_report("a.trip: its text takes 1 MiB of memory; raise --memory");
    trip_json_free(&j);
    trip_budget_discharge(budget, ((uint64_t)1 << 20) - 1000);
    trip_budget_destroy(budget);
}

static void invalid_json_is_no_failure(void **state)
{
    (void)state;
    static const char *const bad[] = { "", "{", "}", "[1,", "\"a", "nul" };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        trip_json j;
        assert_int_equal(trip_json_parse(&j, bad[i], "a.trip", NULL), 0);
        assert_null(j.root);
        trip_json_free(&j);
    }
}

static void deep_nesting_is_refused(void **state)
{
    (void)state;
    trip_json j;
    char text[200] = "";
    for (int i = 0; i < 65; i++)
        strcat(text, "[");
    for (int i = 0; i < 65; i++)
        strcat(text, "]");
    test_catch_reports();
    assert_int_equal(trip_json_parse(&j, text, "a.trip", NULL), TRIP_ERROR);
    assert_one_report("nested more than 64 deep");
    text[129] = 0; /* removes one pair */
    assert_int_equal(trip_json_parse(&j, text + 1, "a.trip", NULL), 0);
    assert_non_null(j.root);
    trip_json_free(&j);
}

static void brackets_and_commas_in_strings_are_not_counted(void **state)
{
    (void)state;
    trip_json j;
    char text[400] = "[\"\\\\\\\"";
    for (int i = 0; i < 100; i++)
        strcat(text, "[,");
    strcat(text, "\"]");
    assert_int_equal(trip_json_parse(&j, text, "a.trip", NULL), 0);
    assert_int_equal(cJSON_GetArraySize(j.root), 1);
    trip_json_free(&j);
}

static void printed_json_escapes_control_characters_and_bad_utf8(void **state)
{
    (void)state;
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "a\x7f\xff", "b\n\xc2\x85\xe2\x80\xae\xc3\xbc\xf0\x9f\x98\x80");
    char *text = trip_json_print(root, false);
    assert_string_equal(text,
                        "{\"a\\u007f\\ufffd\":\"b\\n\\u0085\\u202e\xc3\xbc\xf0\x9f\x98\x80\"}");
    free(text);
    cJSON_Delete(root);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(memory_is_charged_before_it_is_allocated),
        cmocka_unit_test(invalid_json_is_no_failure),
        cmocka_unit_test(deep_nesting_is_refused),
        cmocka_unit_test(brackets_and_commas_in_strings_are_not_counted),
        cmocka_unit_test(printed_json_escapes_control_characters_and_bad_utf8),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
