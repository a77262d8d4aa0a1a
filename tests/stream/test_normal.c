#include "fixture.h"

#include <math.h>

static double angle_degrees(const double a[3], const double b[3])
{
    double c[3] = { a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                    a[0] * b[1] - a[1] * b[0] };
    double sine = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    return atan2(sine, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) * 180 / M_PI;
}

static double length(const double a[3])
{
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

static double random_coordinate(uint64_t *state)
{
    return (double)(fixture_random(state) >> 11) * 0x1p-52 - 1;
}

static void directions_come_back_within_six_hundredths_of_a_degree(void **state)
{
    uint64_t random = 1;
    double worst = 0;
    (void)state;
    for (int i = 0; i < 1000000; i++) {
        double a[3], b[3];
        for (int k = 0; k < 3; k++)
            a[k] = i < 27 ? (int[]){ i, i / 3, i / 9 }[k] % 3 - 1 : random_coordinate(&random);
        if (length(a) == 0)
            continue;
        trip_normal_unpack(trip_normal_pack(a, length(a)), length(a), b);
        worst = fmax(worst, angle_degrees(a, b));
    }
    assert_true(worst < 0.06);
}

/* The root of the magnitude is rounded to 255 steps: off by half a step at most. */
static void magnitudes_come_back_within_half_a_step_of_their_root(void **state)
{
    (void)state;
    for (double m = 0; m <= 2; m += 0.0001) {
        double a[3] = { 0, -m, 0 }, b[3];
        trip_normal_unpack(trip_normal_pack(a, 2), 2, b);
        assert_true(fabs(sqrt(length(b) / 2) - sqrt(m / 2)) <= 0.5 / 255 + 1e-9);
    }
}

static void what_has_no_direction_is_zero(void **state)
{
    const double none[][3] = { { 0, 0, 0 }, { NAN, 1, 0 }, { INFINITY, 0, 0 }, { 1e-9, 0, 0 } };
    double b[3];
    (void)state;
    for (int i = 0; i < 4; i++)
        assert_int_equal(trip_normal_pack(none[i], 1), 0);
    assert_int_equal(trip_normal_pack((double[]){ 1, 2, 3 }, 0), 0);
    trip_normal_unpack(0, 5, b);
    assert_true(b[0] == 0 && b[1] == 0 && b[2] == 0);
}

static void magnitudes_beyond_the_scale_are_cut_to_it(void **state)
{
    double b[3];
    (void)state;
    trip_normal_unpack(trip_normal_pack((double[]){ 0, 0, 1e300 }, 3), 3, b);
    assert_true(fabs(b[2] - 3) < 1e-3);
}

static void morton_codes_interleave_all_bits(void **state)
{
    uint64_t random = 3;
    (void)state;
    for (int i = 0; i < 1000; i++) {
        uint32_t u = (uint32_t)fixture_random(&random),
                 v = (uint32_t)(fixture_random(&random) >> i % 40);
        uint64_t m = trip_morton(u, v);
        for (int b = 0; b < 32; b++) {
            assert_int_equal(m >> 2 * b & 1, u >> b & 1);
            assert_int_equal(m >> (2 * b + 1) & 1, v >> b & 1);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(directions_come_back_within_six_hundredths_of_a_degree),
        cmocka_unit_test(magnitudes_come_back_within_half_a_step_of_their_root),
        cmocka_unit_test(what_has_no_direction_is_zero),
        cmocka_unit_test(magnitudes_beyond_the_scale_are_cut_to_it),
        cmocka_unit_test(morton_codes_interleave_all_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
