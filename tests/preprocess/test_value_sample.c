#include "brick_files.h"

#include <math.h>

#include "typical.h"

enum { ROW = 64 };

/* Adds a cube of values, row by row from `first` on, every `step`-th row. */
static void add_rows(trip_value_sample *s, const float *values, int64_t edge, int64_t first,
                     int64_t step)
{
    for (int64_t row = first; row < edge * edge; row += step)
        for (int64_t x = 0; x < edge; x += ROW) {
            const int64_t at[3] = { x, row % edge, row / edge };
            const size_t count = (size_t)(edge - x < ROW ? edge - x : ROW);
            trip_value_sample_add_row(s, values + row * edge + x, NULL, count, at);
        }
}

static int compare(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static void assert_same(const trip_value_sample *a, const trip_value_sample *b)
{
    size_t counts[2];
    float *sorted[2] = { trip_value_sample_sorted(a, &counts[0]),
                         trip_value_sample_sorted(b, &counts[1]) };
    assert_int_equal(a->log2, b->log2);
    assert_int_equal(counts[0], counts[1]);
    assert_memory_equal(sorted[0], sorted[1], counts[0] * sizeof **sorted);
    free(sorted[0]);
    free(sorted[1]);
}

static void threads_and_order_do_not_change_the_sample(void **state)
{
    (void)state;
    enum { EDGE = 80, VALUES = EDGE * EDGE * EDGE };
    float *values = malloc(VALUES * sizeof *values);
    static trip_value_sample once, parts[3], sum;
    uint64_t random = 3;
    for (int i = 0; i < VALUES; i++)
        values[i] = (float)(test_random(&random) % 1000000);
    add_rows(&once, values, EDGE, 0, 1);
    for (int i = 0; i < 3; i++)
        add_rows(&parts[i], values, EDGE, i, 3);
    for (int i = 2; i >= 0; i--)
        trip_value_sample_add(&sum, &parts[i]);
    assert_true(once.log2 == 4 && once.count > TRIP_SAMPLE_MAX / 2);
    assert_same(&once, &sum);
    assert_true(trip_value_sample_check(&sum, VALUES, 0, 1e6));
    free(values);
}

static void the_extremes_are_exact(void **state)
{
    (void)state;
    enum { EDGE = 80, VALUES = EDGE * EDGE * EDGE };
    float *values = malloc(VALUES * sizeof *values);
    static trip_value_sample s;
    uint64_t random = 5;
    size_t count;
    for (int i = 0; i < VALUES; i++)
        values[i] = (float)(test_random(&random) % 1000000);
    add_rows(&s, values, EDGE, 0, 1);
    qsort(values, VALUES, sizeof *values, compare);
    float *sorted = trip_value_sample_sorted(&s, &count);
    assert_memory_equal(sorted, values, TRIP_EXTREMES * sizeof *values);
    assert_memory_equal(sorted + count - TRIP_EXTREMES, values + VALUES - TRIP_EXTREMES,
                        TRIP_EXTREMES * sizeof *values);
    free(sorted);
    free(values);
}

static void a_small_volume_is_sampled_whole(void **state)
{
    (void)state;
    static trip_value_sample s;
    const float values[6] = { 3, NAN, -0.0f, 7, INFINITY, 5 };
    const uint8_t active[6] = { 1, 1, 1, 0, 1, 1 };
    const float expected[3] = { 0, 3, 5 };
    size_t count;
    trip_value_sample_add_row(&s, values, active, 6, (const int64_t[3]){ 4, 5, 6 });
    float *sorted = trip_value_sample_sorted(&s, &count);
    assert_int_equal(count, 3);
    assert_memory_equal(sorted, expected, sizeof expected);
    free(sorted);
}

#define REFUSE(change)                                                                             \
    do {                                                                                           \
        s = sound;                                                                                 \
        change;                                                                                    \
        assert_false(trip_value_sample_check(&s, 4, 1, 4));                                        \
    } while (0)

static void impossible_samples_are_refused(void **state)
{
    (void)state;
    static trip_value_sample sound, s;
    const float values[4] = { 1, 2, 3, 4 };
    trip_value_sample_add_row(&sound, values, NULL, 4, (const int64_t[3]){ 0, 0, 0 });
    assert_true(trip_value_sample_check(&sound, 4, 1, 4));
    REFUSE(s.count = 5);
    REFUSE(s.log2 = 64);
    REFUSE(s.log2 = 63);
    REFUSE(s.least_count = 5);
    REFUSE(s.greatest_count = 200);
    REFUSE(s.values[2] = 5);
    REFUSE(s.values[1] = NAN);
    REFUSE(s.least[0] = 0);
    REFUSE(s.greatest[0] = INFINITY);
    REFUSE(s.ranks[0] = 255);
}

/* ---- the typical range ---- */

static void tally(trip_tally *t, const float *values, size_t count)
{
    trip_tally_clear(t);
    for (size_t i = 0; i < count; i += ROW)
        trip_tally_row(t, values + i, NULL, count - i < ROW ? count - i : ROW,
                       (const int64_t[3]){ 0, (int64_t)i / ROW, 0 });
}

/* Fills values from 0 to 800 with more of the lower ones, and a background of zeros. */
static void fill(float *values, size_t count)
{
    uint64_t random = 9;
    for (size_t i = 0; i < count; i++) {
        const double u = (double)(test_random(&random) % 1000001) / 1000000;
        values[i] = i % 3 ? (float)(800 * u * u) : 0;
    }
}

static void assert_typical(const float *values, size_t count, float lo, float hi, unsigned below,
                           unsigned above)
{
    static trip_tally t;
    tally(&t, values, count);
    assert_int_equal(trip_typical_set(&t, "test"), 0);
    assert_true(t.typical_min == (double)lo && t.typical_max == (double)hi);
    assert_int_equal(t.below, below);
    assert_int_equal(t.above, above);
}

enum { COUNT = 20000, LARGE = 300000 };

static void lone_values_far_outside_are_left_out(void **state)
{
    (void)state;
    static float values[LARGE];
    const size_t counts[2] = { COUNT, LARGE };
    for (int i = 0; i < 2; i++) {
        const size_t count = counts[i];
        float hi = 0;
        fill(values, count);
        for (size_t n = 0; n < count; n++)
            hi = fmaxf(hi, values[n]);
        assert_typical(values, count, 0, hi, 0, 0);
        values[77] = 1e6f; /* a background voxel: 77 is not a multiple of 3, but not the maximum */
        values[78] = 2000;
        assert_typical(values, count, 0, hi, 0, 2);
        values[81] = -3000;
        assert_typical(values, count, 0, hi, 1, 2);
        values[84] = 1e20f;
        assert_typical(values, count, 0, hi, 1, 3);
    }
}

/* The values fall without a gap from 1 to exp(12), as in a sphere. */
static void a_continuous_tail_is_typical(void **state)
{
    (void)state;
    enum { EDGE = 40 };
    static float values[EDGE * EDGE * EDGE];
    float hi = 0, lo = INFINITY;
    for (int i = 0; i < EDGE * EDGE * EDGE; i++) {
        const double x = i % EDGE - 19.5, y = i / EDGE % EDGE - 19.5, z = i / EDGE / EDGE - 19.5;
        values[i] = (float)exp(12 * fmax(0, 1 - sqrt(x * x + y * y + z * z) / 20));
        hi = fmaxf(hi, values[i]);
        lo = fminf(lo, values[i]);
    }
    assert_typical(values, EDGE * EDGE * EDGE, lo, hi, 0, 0);
}

static void few_values_and_constants_are_typical(void **state)
{
    (void)state;
    const float few[4] = { 1, 2, 3, 1e6f };
    static float same[1000];
    assert_typical(few, 4, 1, 1e6f, 0, 0);
    for (int i = 0; i < 1000; i++)
        same[i] = 5;
    assert_typical(same, 1000, 5, 5, 0, 0);
}

/* ---- fill values ---- */

static const trip_volume_info plain = { .type = TRIP_F32, .slope = 1 };

static unsigned find(const float *values, size_t count, const trip_volume_info *info,
                     trip_fills *fills)
{
    static trip_tally t;
    tally(&t, values, count);
    *fills = (trip_fills){ 0 };
    const int found = trip_typical_find_fills(&t, info, fills, "test");
    assert_int_equal(found, fills->count);
    return (unsigned)found;
}

static void known_fill_values_far_outside_are_found(void **state)
{
    (void)state;
    static const double known[] = {
        1e20,  -1e30,  9.96921e36, 3.40282346638528860e38, -3.40282346638528860e38,
        -9999, -99999, -32768
    };
    static float values[COUNT];
    trip_fills fills;
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        fill(values, COUNT);
        assert_int_equal(find(values, COUNT, &plain, &fills), 0);
        for (size_t n = 0; n < COUNT / 10; n++)
            values[n] = (float)known[i];
        assert_int_equal(find(values, COUNT, &plain, &fills), 1);
        assert_true((float)fills.values[0] == (float)known[i]);
    }
    values[0] = 1e20f; /* two at once */
    assert_int_equal(find(values, COUNT, &plain, &fills), 2);
}

static void other_values_are_no_fill_values(void **state)
{
    (void)state;
    static float values[COUNT];
    trip_fills fills;
    fill(values, COUNT);
    values[5] = 1e6f; /* far outside, but not a known fill value */
    values[6] = 32767;
    values[7] = 65535;
    assert_int_equal(find(values, COUNT, &plain, &fills), 0);
    for (size_t i = 0; i < COUNT; i++)
        values[i] -= 1500; /* -999 is a value like the others */
    values[8] = -999;
    assert_int_equal(find(values, COUNT, &plain, &fills), 0);
    values[9] = -1700; /* -2400 is near the others: by 700 of 800 */
    assert_int_equal(find(values, COUNT, &plain, &fills), 0);
}

/* A scan with slope 1 and intercept -1024. Its padding is stored as -32768. */
static void scaled_fill_values_are_found(void **state)
{
    (void)state;
    static float values[COUNT];
    const trip_volume_info scaled = { .type = TRIP_I16, .slope = 1, .inter = -1024 };
    trip_fills fills;
    fill(values, COUNT);
    for (size_t n = 0; n < COUNT / 10; n++)
        values[n] = -32768 - 1024;
    assert_int_equal(find(values, COUNT, &scaled, &fills), 1);
    assert_true(fills.values[0] == -33792);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threads_and_order_do_not_change_the_sample),
        cmocka_unit_test(the_extremes_are_exact),
        cmocka_unit_test(a_small_volume_is_sampled_whole),
        cmocka_unit_test(impossible_samples_are_refused),
        cmocka_unit_test(lone_values_far_outside_are_left_out),
        cmocka_unit_test(a_continuous_tail_is_typical),
        cmocka_unit_test(few_values_and_constants_are_typical),
        cmocka_unit_test(known_fill_values_far_outside_are_found),
        cmocka_unit_test(other_values_are_no_fill_values),
        cmocka_unit_test(scaled_fill_values_are_found),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
