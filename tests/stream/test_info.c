/* Tests the output of `triptych info` for users and programs. */
#include "fixture.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <sys/wait.h>

/* Runs the program and stores its stdout, or its stderr if `arguments` redirect it. Returns the
 * exit status. */
static int run(const char *arguments, char *output, size_t room)
{
    char command[512];
    snprintf(command, sizeof command, "%s info %s", TRIP_PROGRAM, arguments);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    size_t n = fread(output, 1, room - 1, pipe);
    output[n] = 0;
    return WEXITSTATUS(pclose(pipe));
}

static double number(const cJSON *root, const char *key)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(root, key);
    if (!cJSON_IsNumber(item))
        fail_msg("no number \"%s\"", key);
    return item->valuedouble;
}

static double element(const cJSON *root, const char *key, int i, int k)
{
    const cJSON *item = cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(root, key), i);
    return cJSON_IsArray(item) ? cJSON_GetArrayItem(item, k)->valuedouble : item->valuedouble;
}

static void json_has_the_fields_that_programs_use(void **state)
{
    fixture f;
    char arguments[160], output[8192];
    (void)state;
    fixture_make(&f, &(fixture_params){ .dims = { 30, 20, 10 }, .normals = true });
    snprintf(arguments, sizeof arguments, "--json %s", f.path);
    assert_int_equal(run(arguments, output, sizeof output), 0);
    cJSON *root = cJSON_Parse(output);
    assert_non_null(root);
    assert_true(number(root, "format_version") == 7);
    assert_true(number(root, "value_min") == -1 && number(root, "value_max") == 2);
    assert_true(number(root, "voxels") == 6000);
    assert_true(number(root, "kept") == (double)f.count);
    assert_true(number(root, "bytes") > 3 * 2 * (double)f.count);
    for (int a = 0; a < 3; a++) {
        assert_true(element(root, "dims", a, 0) == 30 - 10 * a);
        assert_true(element(root, "spacing", a, 0) == 1);
        for (int b = 0; b < 4; b++)
            assert_true(element(root, "index_to_world", a, b) == (a == b));
    }
    cJSON_Delete(root);
    fixture_free(&f);
}

static void text_output_fits_one_screen(void **state)
{
    fixture f;
    char arguments[160], output[8192];
    int lines = 0;
    (void)state;
    fixture_make(&f, &(fixture_params){ .dims = { 30, 20, 10 } });
    snprintf(arguments, sizeof arguments, "--verify %s", f.path);
    assert_int_equal(run(arguments, output, sizeof output), 0);
    for (const char *line = output; *line; line = strchr(line, '\n') + 1, lines++)
        assert_true(strchr(line, '\n') - line <= 100);
    assert_in_range(lines, 10, 24);
    assert_non_null(strstr(output, "30 x 20 x 10"));
    assert_non_null(strstr(output, "verified"));
    fixture_free(&f);
}

static void verify_fails_on_a_damaged_file_that_info_does_not_read(void **state)
{
    fixture f;
    char arguments[160], output[8192];
    (void)state;
    fixture_make(&f, &(fixture_params){ .dims = { 30, 20, 10 } });
    fixture_run_command("printf x | dd of=%s/y0.voxels bs=1 seek=1000 conv=notrunc status=none",
                        f.path);
    snprintf(arguments, sizeof arguments, "%s", f.path);
    assert_int_equal(run(arguments, output, sizeof output), 0);
    snprintf(arguments, sizeof arguments, "--verify %s 2>&1", f.path);
    assert_int_equal(run(arguments, output, sizeof output), 1);
    assert_non_null(strstr(output, "y0.voxels: byte 0: "));
    assert_int_equal(strchr(output, '\n')[1], 0);
    fixture_free(&f);
}

static void wrong_usage_gives_exit_status_2_and_one_line(void **state)
{
    const char *const arguments[] = { "2>&1", "--no-such-option a 2>&1", "a b 2>&1" };
    char output[8192];
    (void)state;
    for (int i = 0; i < 3; i++) {
        assert_int_equal(run(arguments[i], output, sizeof output), 2);
        assert_int_equal(strncmp(output, "triptych: ", 10), 0);
        assert_int_equal(strchr(output, '\n')[1], 0);
    }
    assert_int_equal(run("/no/such.trip 2>&1", output, sizeof output), 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(json_has_the_fields_that_programs_use),
        cmocka_unit_test(text_output_fits_one_screen),
        cmocka_unit_test(verify_fails_on_a_damaged_file_that_info_does_not_read),
        cmocka_unit_test(wrong_usage_gives_exit_status_2_and_one_line),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
