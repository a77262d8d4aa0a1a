/* Tests the figures of popping for pictures with known changes. */
#include <math.h>
#include <stdlib.h>

#include "popping.h"
#include "table.h"
#include "test.h"

enum { PIXELS = 4 };

/* Pixel 0 moves by 1/255 in each step, pixel 1 also jumps by 10/255 at 45 degrees with the method
 * axis, and the others never change. */
static int draw(void *user, const measure_popping_setting *of, double degrees)
{
    float *rgba = user;
    const float moved = (float)((degrees - 40) / MEASURE_POPPING_DEGREES / 255);
    for (int i = 0; i < 4 * PIXELS; i++)
        rgba[i] = 0.5F;
    rgba[1] = rgba[4] = moved;
    if (of->method == TRIPTYCH_METHOD_AXIS && degrees > 45 + 0.5 * MEASURE_POPPING_DEGREES)
        rgba[4] += 10.0F / 255;
    return 0;
}

static void a_jump_is_a_change_beyond_the_motion(void **state)
{
    float rgba[4 * PIXELS];
    void *memory = malloc(measure_popping_bytes(PIXELS));
    cJSON *rows = cJSON_CreateArray();
    (void)state;
    assert_int_equal(measure_popping_all(draw, rgba, rgba, PIXELS, memory, 7, rows), 0);
    assert_int_equal(cJSON_GetArraySize(rows), 7);
    for (int i = 0; i < 7; i++) {
        const cJSON *row = cJSON_GetArrayItem(rows, i);
        const double jump = i == 6 ? 10 : 0;
        assert_string_equal(cJSON_GetObjectItem(row, "settings")->valuestring,
                            measure_popping_settings[i].name);
        assert_true(fabs(measure_number(row, "max") - jump) < 1e-3);
        assert_true(fabs(measure_number(row, "mean") - jump / 2) < 1e-3);
        assert_true(fabs(measure_number(row, "motion") - 1) < 1e-3);
    }
    char *svg = measure_popping_svg(rows);
    assert_non_null(strstr(svg, ">axis</text>"));
    assert_null(strstr(svg, ">image</text>"));
    free(svg);
    cJSON_Delete(rows);
    free(memory);
}

static int fail_to_draw(void *user, const measure_popping_setting *of, double degrees)
{
    (void)of;
    (void)degrees;
    ++*(int *)user;
    return -7;
}

static void a_failure_ends_the_measurement(void **state)
{
    static const float rgba[4 * PIXELS];
    int calls = 0;
    void *memory = malloc(measure_popping_bytes(PIXELS));
    cJSON *rows = cJSON_CreateArray();
    (void)state;
    assert_int_equal(measure_popping_all(fail_to_draw, &calls, rgba, PIXELS, memory, 7, rows), -7);
    assert_int_equal(calls, 1);
    assert_int_equal(cJSON_GetArraySize(rows), 0);
    cJSON_Delete(rows);
    free(memory);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_jump_is_a_change_beyond_the_motion),
        cmocka_unit_test(a_failure_ends_the_measurement),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
