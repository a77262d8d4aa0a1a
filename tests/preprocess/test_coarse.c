/* Compares voxels made of eight voxels of the next finer level with results computed by hand. */
#include "test.h"

#include "coarse.h"
#include "deviation.h"

/* The voxel has no neighbours, so each level divides its share by eight. The share never falls
 * below one step. */
static void a_single_voxel_never_vanishes(void **state)
{
    (void)state;
    trip_coarse_value value = { .known = TRIP_COARSE_ALL, .value = 777 };
    trip_coarse_mean mean = { .kept = TRIP_COARSE_ALL,
                              .mean = 777,
                              .cover = { TRIP_COARSE_ALL, TRIP_COARSE_ALL, TRIP_COARSE_ALL } };
    for (int level = 1; level <= 24; level++) {
        trip_coarse_value_sum values = { 0 };
        trip_coarse_mean_sum means;
        trip_coarse_mean_clear(&means);
        trip_coarse_value_add(&values, &value, false);
        trip_coarse_mean_add(&means, &mean, (unsigned)level % 8, NULL);
        trip_coarse_value_get(&values, &value);
        trip_coarse_mean_get(&means, &mean);
        assert_true(value.known >= 1 && fabs(value.known - ldexp(65535, -3 * level)) <= 1);
        assert_true(mean.kept >= 1 && fabs(mean.kept - ldexp(65535, -3 * level)) <= 1);
        assert_int_equal(value.value, 777);
        assert_int_equal(mean.mean, 777);
        for (int a = 0; a < 3; a++) /* the columns cover at least the kept share */
            assert_true(mean.cover[a] >= mean.kept);
    }
}

static void values_are_weighted_by_their_known_share(void **state)
{
    (void)state;
    const trip_coarse_value whole = { .known = TRIP_COARSE_ALL, .value = 10 },
                            some = { .known = 1, .value = UINT16_MAX };
    trip_coarse_value_sum sum = { 0 };
    trip_coarse_value out;
    trip_coarse_value_add_whole(&sum, 4, 1 + 2 + 2 + 2, 1 + 4 + 4 + 4, true);
    trip_coarse_value_get(&sum, &out);
    assert_int_equal(out.value, 2); /* 1.75 */
    assert_int_equal(out.known, (TRIP_COARSE_ALL + 1) / 2);
    sum = (trip_coarse_value_sum){ 0 };
    trip_coarse_value_add(&sum, &whole, false);
    trip_coarse_value_add(&sum, &some, false);
    trip_coarse_value_get(&sum, &out);
    assert_int_equal(out.value, 11); /* (65535 * 10 + 1 * 65535) / 65536 */
}

/* Codes 1, 1, 3, 3 have the variance 1 about 2, and codes 2 and 8 have 9 about 5. Both cubes have
 * the same share, so together they have (1 + 9) / 2 + (1.5 * 1.5). A single voxel has variance 0.
 */
static void variances_of_voxels_and_of_their_means_add_up(void **state)
{
    (void)state;
    trip_coarse_value out[3];
    trip_coarse_value_sum sum = { 0 };
    trip_coarse_value_add_whole(&sum, 4, 1 + 1 + 3 + 3, 1 + 1 + 9 + 9, true);
    trip_coarse_value_get(&sum, &out[0]);
    assert_true(out[0].variance == 1);
    sum = (trip_coarse_value_sum){ 0 };
    for (int i = 0; i < 2; i++) {
        trip_coarse_value_add_whole(&sum, 1, 2, 4, i);
        trip_coarse_value_add_whole(&sum, 1, 8, 64, i);
    }
    trip_coarse_value_get(&sum, &out[1]);
    assert_true(out[1].variance == 9);
    sum = (trip_coarse_value_sum){ 0 };
    trip_coarse_value_add(&sum, &out[0], false);
    trip_coarse_value_add(&sum, &out[1], false);
    trip_coarse_value_get(&sum, &out[2]);
    assert_true((double)out[2].variance == (1 + 9) / 2.0 + 1.5 * 1.5);
    sum = (trip_coarse_value_sum){ 0 };
    trip_coarse_value_add_whole(&sum, 1, UINT16_MAX, (uint64_t)UINT16_MAX * UINT16_MAX, true);
    trip_coarse_value_get(&sum, &out[0]);
    assert_true(out[0].variance == 0);
    for (int level = 2; level <= 9; level++) { /* rounded shares leave no trace */
        sum = (trip_coarse_value_sum){ 0 };
        for (int i = 0; i < 1 + level % 8; i++)
            trip_coarse_value_add(&sum, &out[0], false);
        trip_coarse_value_get(&sum, &out[0]);
        assert_true(out[0].variance == 0);
    }
}

/* The largest deviation of codes is half of their range. */
static void deviations_are_packed_to_the_nearest_code(void **state)
{
    (void)state;
    assert_int_equal(trip_deviation_pack(0), 0);
    assert_int_equal(trip_deviation_pack(32767.5 * 32767.5), 255);
    assert_true(trip_deviation(255) == 32767.5 && trip_deviation(0) == 0);
    for (unsigned d = 1; d < 255; d++) {
        const double sigma = 32767.5 * d * d / (255.0 * 255);
        assert_close(trip_deviation(d), sigma, 1e-9);
        assert_int_equal(trip_deviation_pack(sigma * sigma), d);
        const double up = 32767.5 * (d + 0.49) * (d + 0.49) / (255.0 * 255);
        const double down = 32767.5 * (d - 0.49) * (d - 0.49) / (255.0 * 255);
        assert_int_equal(trip_deviation_pack(up * up), d);
        assert_int_equal(trip_deviation_pack(down * down), d);
    }
}

/* Two halves of a column overlap as if by chance and leave a quarter open. So 3/16 of four columns
 * are covered. */
static void columns_overlap_as_if_by_chance(void **state)
{
    (void)state;
    const trip_coarse_mean half = { .kept = 32768, .cover = { 32768, 32768, 32768 } };
    trip_coarse_mean_sum sum;
    trip_coarse_mean out;
    trip_coarse_mean_clear(&sum);
    trip_coarse_mean_add(&sum, &half, 0, NULL);
    trip_coarse_mean_add(&sum, &half, 1, NULL); /* the next voxel along x */
    trip_coarse_mean_get(&sum, &out);
    assert_int_equal(out.kept, 8192);
    assert_true(fabs(out.cover[0] - 65535 * 3 / 16.0) <= 65535 / 510.0);
    for (int a = 1; a < 3; a++) /* half of each of two columns */
        assert_true(fabs(out.cover[a] - 65535 / 4.0) <= 65535 / 510.0);
}

static void gradients_of_unknown_sign_add_up(void **state)
{
    (void)state;
    const double long_one[3] = { 0, 0, 2 }, short_one[3] = { 0, 0, -1 };
    trip_coarse_mean_sum sum;
    double gradient[3];
    trip_coarse_mean_clear(&sum);
    trip_coarse_mean_add_whole(&sum, 1, 0, long_one);
    trip_coarse_mean_add_whole(&sum, 1, 1, short_one);
    trip_coarse_mean_gradient(&sum, gradient);
    assert_true(gradient[0] == 0 && gradient[1] == 0);
    assert_close(gradient[2], (2 * 2 + 1 * 1) / 3.0, 1e-6); /* weighted by length */
    trip_coarse_mean_clear(&sum);
    trip_coarse_mean_gradient(&sum, gradient);
    assert_true(gradient[2] == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_single_voxel_never_vanishes),
        cmocka_unit_test(values_are_weighted_by_their_known_share),
        cmocka_unit_test(variances_of_voxels_and_of_their_means_add_up),
        cmocka_unit_test(deviations_are_packed_to_the_nearest_code),
        cmocka_unit_test(columns_overlap_as_if_by_chance),
        cmocka_unit_test(gradients_of_unknown_sign_add_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
