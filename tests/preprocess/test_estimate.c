#include "brick_files.h"
#include "estimate.h"

#include <math.h>

/* Size of a volume with values that grow along Z. The first slices alone would give a wrong
 * estimate. */
enum { NX = 64, NY = 48, NZ = 512, N = NX * NY * NZ };

static uint8_t values[N];

static trip_brick_params make_volume(void)
{
    static char input[128], output[128];
    for (int i = 0; i < N; i++)
        values[i] = (uint8_t)(i / NX / NY / 2);
    test_write("v.raw", values, sizeof values);
    strcpy(input, test_path("v.raw"));
    strcpy(output, test_path("v.trip"));
    return (trip_brick_params){ .input = input,
                                .output = output,
                                .volume = { .raw_dims = { NX, NY, NZ }, .raw_type = "uint8" },
                                .levels = -1,
                                .memory_bytes = (uint64_t)1 << 26,
                                .threads = 2 };
}

static void a_sample_estimates_the_voxels_kept_and_bytes_written(void **state)
{
    (void)state;
    trip_brick_params p = make_volume();
    trip_brick_estimate e;
    trip_brick_summary s;
    p.ranges = &(trip_value_range){ 128, 191 }; /* a quarter of the voxels */
    p.range_count = 1;
    p.normals = TRIP_NORMALS_STORED;
    assert_int_equal(trip_brick_estimate_make(&p, &e), 0);
    assert_int_equal(e.voxels, N);
    assert_true(e.kept > N / 4 * 0.8 && e.kept < N / 4 * 1.2);
    /* Each list has one byte of code and three of normal for each splat, plus the masks. */
    assert_true(e.bytes >= 12 * e.kept && e.bytes < 13.5 * (double)e.kept);
    assert_true(e.seconds > 0 && e.free_bytes > 0);
    assert_false(test_exists("v.trip"));
    assert_false(test_exists("v.trip.spill"));
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_int_equal(s.kept, N / 4);
}

static void an_automatic_envelope_is_estimated_from_the_sample(void **state)
{
    (void)state;
    trip_brick_params p = make_volume();
    trip_brick_estimate e;
    trip_brick_summary s;
    assert_int_equal(trip_brick_estimate_make(&p, &e), 0);
    assert_int_equal(trip_brick(&p, &s), 0);
    assert_true((double)e.kept > 0.8 * (double)s.kept && (double)e.kept < 1.2 * (double)s.kept);
}

static void temporary_data_is_estimated_if_memory_is_short(void **state)
{
    (void)state;
    trip_brick_params p = make_volume();
    trip_brick_estimate e;
    trip_brick_summary s;
    p.keep_all = true;
    p.threads = 1;
    for (uint64_t memory = (uint64_t)1 << 25; memory <= (uint64_t)1 << 28; memory *= 8) {
        p.memory_bytes = memory;
        p.replace = true;
        assert_int_equal(trip_brick_estimate_make(&p, &e), 0);
        assert_int_equal(e.kept, N);
        assert_int_equal(trip_brick(&p, &s), 0);
        assert_int_equal(e.temporary_bytes > 0, s.temporary_bytes > 0);
    }
}

/* Each list has one byte of code and an eighth of mask for each splat, plus the presence words. */
static void without_normals_the_estimate_is_smaller(void **state)
{
    (void)state;
    trip_brick_params p = make_volume();
    trip_brick_estimate e;
    p.keep_all = true;
    p.normals = TRIP_NORMALS_NONE;
    assert_int_equal(trip_brick_estimate_make(&p, &e), 0);
    assert_true(e.bytes >= 3 * (uint64_t)N && e.bytes < 4 * (uint64_t)N);
    assert_int_equal(e.halo, 0);
}

/* The estimate samples 16 evenly spaced portions of 4 slices. None of them has a finite value. */
static void a_sample_without_finite_values_gives_no_estimate(void **state)
{
    (void)state;
    enum { SIDE = 16, AREA = SIDE * SIDE, DEPTH = 2000, FIRST = 44, SLICES = 8 };
    static float floats[AREA * DEPTH];
    trip_brick_params p = make_volume();
    trip_brick_estimate e;
    trip_brick_summary s;
    for (int i = 0; i < AREA * DEPTH; i++)
        floats[i] = i / AREA >= FIRST && i / AREA < FIRST + SLICES ? (float)(i % AREA) : NAN;
    test_write("v.raw", floats, sizeof floats);
    p.volume = (trip_volume_params){ .raw_dims = { SIDE, SIDE, DEPTH }, .raw_type = "float" };
    for (int ranges = 0; ranges < 2; ranges++) {
        p.ranges = &(trip_value_range){ 100, 200 };
        p.range_count = (size_t)ranges;
        p.max_bytes = 1 << 20; /* the run samples the volume for this limit, too */
        p.replace = true;
        assert_int_equal(trip_brick_estimate_make(&p, &e), 0);
        assert_int_equal(trip_brick(&p, &s), 0);
        assert_int_equal(e.voxels, AREA * DEPTH);
        assert_int_equal(e.kept, s.kept);
    }
    for (int i = 0; i < AREA * DEPTH; i++)
        floats[i] = NAN;
    test_write("v.raw", floats, sizeof floats);
    test_report[0] = 0;
    assert_int_equal(trip_brick_estimate_make(&p, &e), TRIP_ERROR);
    assert_non_null(strstr(test_report, "has no finite values"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_sample_estimates_the_voxels_kept_and_bytes_written,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(an_automatic_envelope_is_estimated_from_the_sample,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(temporary_data_is_estimated_if_memory_is_short, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(a_sample_without_finite_values_gives_no_estimate,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(without_normals_the_estimate_is_smaller, test_begin,
                                        test_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
