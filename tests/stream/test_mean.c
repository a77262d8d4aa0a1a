#include "fixture.h"

#include <math.h>

#include "mean.h"

/* Values 0 to 65535 with one code each. */
static const trip_mean_scale whole = { 0, 65535 };

static void a_full_cube_keeps_its_extinction(void **state)
{
    (void)state;
    unsigned code = trip_mean_pack(&whole, 65535, 1, 1);
    assert_int_equal(code, 65535);
    assert_int_equal(trip_mean_value(&whole, code), 65535);
    assert_true(trip_mean_extinction(code % TRIP_MEAN_SHARES, 3.5, 0.25) == 3.5);
}

static void shares_of_two_voxels_along_each_axis_are_exact(void **state)
{
    (void)state;
    for (int columns = 1; columns <= 4; columns++)
        for (int kept = columns; kept <= 2 * columns; kept++) {
            double cover = columns / 4.0, depth = kept / (2.0 * columns);
            unsigned shares = trip_mean_pack(&whole, 0, cover, depth) % TRIP_MEAN_SHARES;
            assert_true(trip_mean_cover(shares) == cover);
            /* Depths in sixths have no exact code, all others do. */
            assert_true(fabs(trip_mean_depth(shares) - depth) <= (columns == 3 ? 1 / 23.9 : 0));
        }
}

static void covers_and_depths_are_the_nearest_available(void **state)
{
    (void)state;
    for (double x = 1.0 / 1000; x <= 1; x += 1.0 / 1000) {
        const unsigned picked = trip_mean_pack_shares(x, x);
        for (unsigned other = 0; other < TRIP_MEAN_SHARES; other++) {
            assert_true(fabs(trip_mean_cover(picked) - x) <=
                        fabs(trip_mean_cover(other) - x) + 1e-12);
            assert_true(fabs(trip_mean_depth(picked) - x) <=
                        fabs(trip_mean_depth(other) - x) + 1e-12);
        }
    }
}

static void values_are_the_nearest_of_1024_steps(void **state)
{
    (void)state;
    for (unsigned value = 0; value < 65536; value++) {
        unsigned back = trip_mean_value(&whole, trip_mean_pack(&whole, value, 0.5, 0.5));
        assert_true(fabs((double)back - value) <= 65535.0 / 1023 / 2 + 1);
    }
}

/* The means cover the 1300 values present, not the 65536 values of the type. Errors are at most
 * half a step, and both ends are exact. */
static void steps_cover_the_range_of_values(void **state)
{
    (void)state;
    const trip_mean_scale scale =
        trip_mean_scale_make(100, 1400, &(trip_codes){ .lo = 0, .hi = 65535 });
    assert_true(scale.lo == 100 && scale.width == 1300);
    for (unsigned value = 100; value <= 1400; value++) {
        unsigned back = trip_mean_value(&scale, trip_mean_pack(&scale, value, 1, 1));
        assert_true(fabs((double)back - value) <= 1300.0 / 1023 / 2 + 0.5);
        if (value == 100 || value == 1400)
            assert_int_equal(back, value);
    }
    /* Values beyond the range of codes get the nearest code. */
    const trip_mean_scale cut = trip_mean_scale_make(-10, 20, &(trip_codes){ .lo = 0, .hi = 10 });
    assert_true(cut.lo == 0 && cut.width == 65535);
    const trip_mean_scale one = trip_mean_scale_make(5, 5, &(trip_codes){ .lo = 0, .hi = 10 });
    assert_int_equal(trip_mean_value(&one, trip_mean_pack(&one, 32768, 1, 1)), 32768);
}

/* Columns of the same depth stand side by side. The transmittance is the mean of the transmittances
 * of all columns. */
static void opacity_is_the_mean_over_columns(void **state)
{
    (void)state;
    const double length = 1.5;
    for (double k = 0.01; k < 1000; k *= 7) {
        double all[TRIP_MEAN_SHARES];
        trip_mean_extinctions(k, length, all);
        for (unsigned shares = 0; shares < TRIP_MEAN_SHARES; shares++) {
            const double cover = trip_mean_cover(shares);
            double through = 1 - cover + cover * exp(-k * trip_mean_depth(shares) * length);
            double own = trip_mean_extinction(shares, k, length);
            assert_true(fabs(exp(-own * length) - through) < 1e-12);
            assert_true(all[shares] == own);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_full_cube_keeps_its_extinction),
        cmocka_unit_test(shares_of_two_voxels_along_each_axis_are_exact),
        cmocka_unit_test(covers_and_depths_are_the_nearest_available),
        cmocka_unit_test(values_are_the_nearest_of_1024_steps),
        cmocka_unit_test(steps_cover_the_range_of_values),
        cmocka_unit_test(opacity_is_the_mean_over_columns),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
