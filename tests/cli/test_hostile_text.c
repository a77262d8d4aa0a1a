/* Tests the text of hostile data sets. The memory and time for it are bounded, and it reaches a
 * terminal only with escapes. */
#include "program.h"

#include <stdbool.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "dataset.h"
#include "sanitizers.h"
#include "skips.h"
#include "writer.h"

enum { MIB = 1 << 20, TEXT_BYTES = 16 * MIB, MEMORY = 64 * MIB };
/* Bound on the program, its libraries and the stacks of its threads. */
enum { PROGRAM_BYTES = 56 * MIB };

/* Writes a data set of one voxel with this text. */
static void write_dataset(const char *path, const char *text)
{
    trip_budget *budget;
    trip_writer *w;
    const uint32_t voxel = 1000u << 16;
    assert_int_equal(trip_budget_create(&budget, 128 * MIB), 0);
    assert_int_equal(
        trip_writer_open(&w, path,
                         &(trip_writer_params){ .dims = { 4, 4, 4 },
                                                .index_to_world = trip_affine_identity(),
                                                .codes = { .code_hi = 1 },
                                                .replace = true },
                         budget),
        0);
    for (int axis = 0; axis < 3; axis++)
        assert_int_equal(trip_writer_append(w, (unsigned)axis, 0, 0, 0, &voxel, NULL, 1), 0);
    assert_int_equal(
        trip_writer_finish(w, &(trip_writer_summary){ .value_max = 1, .voxels = 64, .text = text }),
        0);
    trip_budget_destroy(budget);
}

/* Returns `begin`, as many copies of `unit` as TEXT_BYTES allow, and `end`. */
static char *repeat(const char *begin, const char *unit, const char *end)
{
    char *text = malloc(TEXT_BYTES + 1), *at = stpcpy(text, begin);
    size_t bytes = strlen(unit), room = TEXT_BYTES - strlen(begin) - strlen(end);
    for (size_t used = 0; used + bytes <= room; used += bytes)
        at = stpcpy(at, unit);
    strcpy(at, end);
    return text;
}

#if !TEST_ADDRESS_SANITIZER
static long peak_of_children(void)
{
    struct rusage usage;
    getrusage(RUSAGE_CHILDREN, &usage);
    return usage.ru_maxrss * 1024;
}
#endif

/* The JSON tree of such a text needs up to forty times its length. */
static void text_of_16_mib_stays_within_the_given_memory(void **state)
{
    (void)state;
    program_run *r = malloc(sizeof *r);
    const char *const texts[][3] = {
        { "{\"a\":[1", ",1", "]}" },   { "{\"envelope\":[[1,2]", ",[1,2]", "]}" },
        { "{\"a\":[{}", ",{}", "]}" }, { "{\"a\":1", ",\"\":\"\"", "}" },
        { "{\"a\":", "[", "" },        { "{\"a\":\"", "\\\"", "\"}" },
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        char *text = repeat(texts[i][0], texts[i][1], texts[i][2]);
        write_dataset("d.trip", text);
        free(text);
        program_call(r, "render d.trip -o p.png --size 16x16 --renderer cpu --memory %dM",
                     MEMORY / MIB);
        if (i < 5)
            assert_fails(r, 1);
        else
            assert_works(r);
    }
    free(r);
#if TEST_ADDRESS_SANITIZER
    test_lacks("memory without AddressSanitizer's own");
#else
    assert_true(peak_of_children() < MEMORY + PROGRAM_BYTES);
#endif
}

/* An algorithm of quadratic time would take a quarter of an hour. */
static void large_envelopes_and_histograms_take_linear_time(void **state)
{
    (void)state;
    enum { RANGES = 60000 };
    program_run *r = malloc(sizeof *r);
    char *text = malloc(64 * RANGES), *at = text;
    at += sprintf(at, "{\"envelope\":[");
    for (int i = RANGES; i > 0; i--)
        at += sprintf(at, "[%d,%d]%s", 10 * i, 10 * i + 1, i > 1 ? "," : "");
    at += sprintf(at, "],\"histogram\":{\"value_min\":0,\"value_max\":%d,\"counts\":[1",
                  10 * RANGES + 10);
    for (int i = 1; i < RANGES; i++)
        at += sprintf(at, ",1");
    sprintf(at, "]}}");
    write_dataset("d.trip", text);
    free(text);
    program_call(r, "render d.trip -o p.png --size 16x16 --renderer cpu");
    assert_int_equal(r->exit_status, 0);
    assert_non_null(strstr(r->err, "that bricking dropped"));
    free(r);
}

static bool is_clean(const char *text)
{
    for (const unsigned char *p = (const unsigned char *)text; *p; p++)
        if ((*p < 0x20 && *p != '\n') || *p >= 0x7f)
            return false;
    return true;
}

/* Keys and values of the file hold terminal escapes of one and of two bytes, a mark that reverses
 * the direction of writing, and invalid UTF-8. */
static void control_characters_and_bad_utf8_are_escaped(void **state)
{
    (void)state;
    program_run *r = malloc(sizeof *r);
    char text[4096];
    program_read(TRIP_SOURCE_DIR "/tests/regress/text_control_characters.json", text, sizeof text);
    assert_false(is_clean(text));
    write_dataset("d.trip", text);
    program_call(r, "info d.trip");
    assert_works(r);
    assert_true(is_clean(r->out));
    assert_non_null(strstr(r->out, "red \\x1b[31m del \\x7f"));
    assert_non_null(strstr(r->out, "c1 \\xc2\\x9b31m turned \\xe2\\x80\\xae bad \\xff\\xc3("));
    program_call(r, "info --json d.trip");
    assert_works(r);
    for (const char *p = r->out; *p; p++)
        assert_true((*p >= 0x20 && *p < 0x7f) || *p == '\n' || *p == '\t');
    cJSON *root = cJSON_Parse(r->out);
    const cJSON *source = cJSON_GetObjectItem(root, "source");
    const char *value = cJSON_GetStringValue(cJSON_GetObjectItem(source, "grid"));
    assert_non_null(value);
    assert_string_equal(value, "c1 \xc2\x9b"
                               "31m turned \xe2\x80\xae bad \xef\xbf\xbd\xef\xbf\xbd(");
    cJSON_Delete(root);
    free(r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(text_of_16_mib_stays_within_the_given_memory,
                                        program_enter_folder, program_leave_folder),
        cmocka_unit_test_setup_teardown(large_envelopes_and_histograms_take_linear_time,
                                        program_enter_folder, program_leave_folder),
        cmocka_unit_test_setup_teardown(control_characters_and_bad_utf8_are_escaped,
                                        program_enter_folder, program_leave_folder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
