/* Tests the kernels' weights by the functions they must reproduce. */
#include "kernel.h"

#include <math.h>

#include "test.h"

/* Returns the sum of the weights times a power of the voxel's coordinate. */
static double moment(trip_kernel kernel, double position, int power)
{
    double weights[TRIP_KERNEL_TAPS], sum = 0;
    trip_kernel_weights(kernel, position, weights);
    for (int i = 0; i < TRIP_KERNEL_TAPS; i++)
        sum += weights[i] * pow(i - 1, power);
    return sum;
}

static void constants_lines_and_parabolas_are_reproduced(void **state)
{
    (void)state;
    for (double x = 0; x <= 1; x += 1.0 / 64) {
        assert_close(moment(TRIP_KERNEL_LINEAR, x, 0), 1, 1e-15);
        assert_close(moment(TRIP_KERNEL_LINEAR, x, 1), x, 1e-15);
        for (int power = 0; power < 3; power++)
            assert_close(moment(TRIP_KERNEL_CUBIC, x, power), pow(x, power), 1e-14);
        assert_close(moment(TRIP_KERNEL_GAUSSIAN, x, 0), 1, 1e-14);
    }
}

/* Hermite's cubic between two values with central differences as slopes. */
static void cubic_is_the_curve_through_values_with_their_central_differences(void **state)
{
    (void)state;
    const double v[4] = { 3, -1, 4, 1.5 };
    for (double x = 0; x <= 1; x += 1.0 / 64) {
        double w[4], sum = 0, m0 = (v[2] - v[0]) / 2, m1 = (v[3] - v[1]) / 2;
        double x2 = x * x, x3 = x2 * x;
        trip_kernel_weights(TRIP_KERNEL_CUBIC, x, w);
        for (int i = 0; i < 4; i++)
            sum += w[i] * v[i];
        assert_close(sum,
                     (2 * x3 - 3 * x2 + 1) * v[1] + (x3 - 2 * x2 + x) * m0 +
                         (3 * x2 - 2 * x3) * v[2] + (x3 - x2) * m1,
                     1e-14);
    }
}

/* On a voxel and between two, with sigma 0.6. */
static void gaussian_has_the_profile_of_a_splat_of_radius_2(void **state)
{
    (void)state;
    const double edge = exp(-50.0 / 9), one = exp(-1 / 0.72) - edge;
    double w[4];
    trip_kernel_weights(TRIP_KERNEL_GAUSSIAN, 0, w);
    assert_close(w[0], one / (1 - edge + 2 * one), 1e-14);
    assert_close(w[1], (1 - edge) / (1 - edge + 2 * one), 1e-14);
    assert_close(w[2], w[0], 1e-14);
    assert_close(w[3], 0, 1e-14);
    trip_kernel_weights(TRIP_KERNEL_GAUSSIAN, 0.5, w);
    assert_close(w[0], w[3], 1e-14);
    assert_close(w[1], w[2], 1e-14);
    assert_close(w[0] / w[1], (exp(-2.25 / 0.72) - edge) / (exp(-0.25 / 0.72) - edge), 1e-14);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(constants_lines_and_parabolas_are_reproduced),
        cmocka_unit_test(cubic_is_the_curve_through_values_with_their_central_differences),
        cmocka_unit_test(gaussian_has_the_profile_of_a_splat_of_radius_2),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
