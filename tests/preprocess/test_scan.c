#include "brick_files.h"

#include <math.h>

#include "scan.h"

static void tally_row(trip_tally *t, const float *values, const uint8_t *active, size_t count)
{
    trip_tally_range(t, values, active, count);
    trip_tally_count(t, values, active, count);
}

static void integers_are_binned_as_if_counted_one_by_one(void **state)
{
    (void)state;
    static trip_tally t;
    trip_histogram h;
    uint64_t random = 1, expected[1024] = { 0 };
    trip_tally_clear(&t);
    float row[100];
    /* Every row has a wider range than the preceding row, so the tally merges bins. */
    int lo = 0, hi = 0;
    for (int r = 0; r < 400; r++)
        for (int i = 0; i < 100; i++) {
            int value = (int)(test_random(&random) % (unsigned)(8 * r + 1)) - 2 * r;
            lo = value < lo ? value : lo;
            hi = value > hi ? value : hi;
        }
    random = 1;
    for (int r = 0; r < 400; r++) {
        for (int i = 0; i < 100; i++) {
            int value = (int)(test_random(&random) % (unsigned)(8 * r + 1)) - 2 * r;
            int bin = (int)((double)(value - lo) / (hi - lo) * 1024);
            expected[bin < 1024 ? bin : 1023]++;
            row[i] = (float)value;
        }
        tally_row(&t, row, NULL, 100);
    }
    trip_tally_histogram(&t, &h);
    assert_int_equal(h.total, 40000);
    assert_true(h.value_min == lo && h.value_max == hi);
    assert_memory_equal(h.counts, expected, sizeof expected);
}

static void order_and_distribution_do_not_change_the_tally(void **state)
{
    (void)state;
    enum { VALUES = 4096, ROW = 64 };
    static float values[VALUES];
    static trip_tally once, shared[3], sum;
    uint64_t random = 7;
    for (int i = 0; i < VALUES; i++)
        values[i] =
            ldexpf((float)test_random(&random) - 1e9f, (int)(test_random(&random) % 60) - 60);
    trip_tally_clear(&once);
    trip_tally_clear(&sum);
    for (int i = 0; i < 3; i++)
        trip_tally_clear(&shared[i]);
    for (int i = 0; i < VALUES; i += ROW) {
        tally_row(&once, values + i, NULL, ROW);
        tally_row(&shared[i / ROW % 3], values + VALUES - ROW - i, NULL, ROW);
    }
    for (int i = 2; i >= 0; i--)
        trip_tally_add(&sum, &shared[i]);
    trip_histogram a, b;
    trip_tally_histogram(&once, &a);
    trip_tally_histogram(&sum, &b);
    assert_memory_equal(&a, &b, sizeof a);
    assert_int_equal(sum.voxels, VALUES);
}

static void non_finite_and_inactive_voxels_are_left_out(void **state)
{
    (void)state;
    static trip_tally t;
    const float values[6] = { NAN, 3, INFINITY, -100, -INFINITY, 5 };
    const uint8_t active[6] = { 1, 1, 1, 0, 1, 1 };
    trip_histogram h;
    trip_tally_clear(&t);
    tally_row(&t, values, active, 6);
    assert_int_equal(t.voxels, 5);
    assert_int_equal(t.finite, 2);
    assert_true(t.value_min == 3 && t.value_max == 5);
    trip_tally_histogram(&t, &h);
    assert_int_equal(h.total, 2);
    assert_int_equal(h.counts[0], 1);
    assert_int_equal(h.counts[1023], 1);
}

static void zero_has_no_sign(void **state)
{
    (void)state;
    static trip_tally t;
    const float values[2] = { -0.0f, 0 };
    trip_tally_clear(&t);
    tally_row(&t, values, NULL, 2);
    assert_true(!signbit(t.value_min) && !signbit(t.value_max));
}

#define REFUSE(change)                                                                             \
    do {                                                                                           \
        t = sound;                                                                                 \
        change;                                                                                    \
        assert_false(trip_tally_check(&t));                                                        \
    } while (0)

/* The values 1 to 4 cover 12289 bins of width 2^-12, from bin 4096 to bin 16384. */
static void impossible_tallies_are_refused(void **state)
{
    (void)state;
    static trip_tally sound, t;
    const float values[5] = { 1, 2, 3, 4, NAN };
    trip_tally_clear(&t);
    assert_true(trip_tally_check(&t));
    tally_row(&t, values, NULL, 5);
    sound = t;
    assert_true(trip_tally_check(&t));
    assert_true(t.exponent == -12 && t.first == 4096 && t.counts[12288] == 1);
    REFUSE(t.voxels = 3);
    REFUSE(t.finite = 3);
    REFUSE(t.kept = 6);
    REFUSE(t.borders = 11);
    REFUSE(t.counted = 3);
    REFUSE(t.counts[1]++);
    REFUSE((t.counts[0] = UINT64_MAX, t.counts[1] = 2));
    REFUSE((t.counts[0] = 0, t.counts[12289] = 1)); /* a count above the maximum 4 */
    REFUSE(t.first--);                              /* the first bin lies below the minimum 1 */
    REFUSE(
        (memset(t.counts, 0, sizeof t.counts), t.counts[0] = 4, t.exponent = -11, t.first = 2048));
    REFUSE(t.exponent = -150);
    REFUSE(t.first = INT64_MIN);
    REFUSE(t.value_min = NAN);
    REFUSE(t.value_max = INFINITY);
    REFUSE(t.value_max = 0.5);
    REFUSE(t.value_max = 4.1); /* no float has this value */
    trip_tally_clear(&sound);
    REFUSE(t.value_min = 0);
    REFUSE(t.value_max = 0);
    sound.voxels = sound.finite = 1; /* a sampled voxel is in no bin */
    REFUSE(t.voxels = 1);
    sound.value_min = sound.value_max = 7;
    assert_true(trip_tally_check(&sound));
    REFUSE(t.value_max = 6);
}

static void a_single_value_makes_one_bin(void **state)
{
    (void)state;
    static trip_tally t;
    const float values[3] = { -0.1f, -0.1f, -0.1f };
    trip_histogram h;
    trip_tally_clear(&t);
    tally_row(&t, values, NULL, 3);
    trip_tally_histogram(&t, &h);
    assert_int_equal(h.counts[0], 3);
    assert_true(h.value_min == h.value_max);
}

static void the_extremes_of_float_are_counted(void **state)
{
    (void)state;
    static trip_tally t;
    const float values[4] = { 1e-45f, -3.4028235e38f, 3.4028235e38f, 0 };
    trip_histogram h;
    trip_tally_clear(&t);
    for (int i = 0; i < 4; i++)
        tally_row(&t, values + i, NULL, 1);
    trip_tally_histogram(&t, &h);
    assert_int_equal(h.counts[0], 1);
    assert_int_equal(h.counts[512], 2);
    assert_int_equal(h.counts[1023], 1);
    trip_tally_clear(&t); /* no bin is narrower than the distance between floats */
    tally_row(&t, values, NULL, 1);
    assert_int_equal(t.exponent, -149);
    assert_true(trip_tally_check(&t));
}

static int scan_raw(trip_tally *t, const char *type, int64_t nx, int64_t ny, int64_t nz,
                    unsigned threads)
{
    trip_budget *budget;
    trip_workers *workers;
    trip_volume *volume;
    trip_volume_params p = { .raw_dims = { nx, ny, nz }, .raw_type = type };
    assert_int_equal(trip_budget_create(&budget, (uint64_t)1 << 28), 0);
    assert_int_equal(trip_workers_create(&workers, threads), 0);
    assert_int_equal(trip_volume_open(&volume, test_path("v.raw"), &p, budget), 0);
    int status =
        trip_scan_volume(t, volume, "v.raw", workers, &(trip_scan_params){ .slices = 3 }, budget);
    trip_volume_close(volume);
    trip_workers_destroy(workers);
    trip_budget_destroy(budget);
    return status;
}

static void any_number_of_threads_scans_the_whole_volume(void **state)
{
    (void)state;
    enum { NX = 70, NY = 65, NZ = 20, N = NX * NY * NZ };
    static uint16_t values[N];
    static trip_tally t;
    uint64_t random = 3, sum = 0;
    unsigned lo = 65535, hi = 0;
    for (int i = 0; i < N; i++) {
        values[i] = (uint16_t)(100 + test_random(&random) % 4000);
        lo = values[i] < lo ? values[i] : lo;
        hi = values[i] > hi ? values[i] : hi;
    }
    test_write("v.raw", values, sizeof values);
    for (unsigned threads = 1; threads < 5; threads++) {
        trip_histogram h;
        sum = 0;
        assert_int_equal(scan_raw(&t, "uint16", NX, NY, NZ, threads), 0);
        assert_int_equal(t.voxels, N);
        assert_true(t.value_min == lo && t.value_max == hi);
        trip_tally_histogram(&t, &h);
        for (int i = 0; i < 1024; i++)
            sum += h.counts[i];
        assert_int_equal(sum, N);
    }
}

static void a_volume_without_a_finite_value_is_refused(void **state)
{
    (void)state;
    static trip_tally t;
    float values[27];
    for (int i = 0; i < 27; i++)
        values[i] = i % 2 ? NAN : INFINITY;
    test_write("v.raw", values, sizeof values);
    assert_int_equal(scan_raw(&t, "float", 3, 3, 3, 2), TRIP_ERROR);
    assert_string_equal(test_report, "triptych: brick: v.raw: has no finite values\n");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(integers_are_binned_as_if_counted_one_by_one),
        cmocka_unit_test(order_and_distribution_do_not_change_the_tally),
        cmocka_unit_test(non_finite_and_inactive_voxels_are_left_out),
        cmocka_unit_test(zero_has_no_sign),
        cmocka_unit_test(impossible_tallies_are_refused),
        cmocka_unit_test(a_single_value_makes_one_bin),
        cmocka_unit_test(the_extremes_of_float_are_counted),
        cmocka_unit_test_setup_teardown(any_number_of_threads_scans_the_whole_volume, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(a_volume_without_a_finite_value_is_refused, test_begin,
                                        test_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
