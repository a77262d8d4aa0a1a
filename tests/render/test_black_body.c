/* Compares black-body colours with the Planckian locus tabulated by the CIE, and the transfer
 * curve with the sRGB curve. */
#include "test.h"

#include <math.h>

#include "black_body.h"

static void chromaticity_is_that_of_the_planckian_locus(void **state)
{
    (void)state;
    const double known[][4] = {
        /* kelvin, x, y, tolerance of the fit */
        { 1000, 0.6528, 0.3444, 0.012 },   { 1500, 0.5857, 0.3931, 0.005 },
        { 2000, 0.5267, 0.4133, 0.003 },   { 2856, 0.4476, 0.4074, 0.0015 },
        { 4000, 0.3805, 0.3768, 0.001 },   { 6500, 0.3135, 0.3237, 0.0005 },
        { 10000, 0.2807, 0.2884, 0.0005 },
    };
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        double xyz[3];
        trip_black_body_xyz(known[i][0], xyz);
        const double sum = xyz[0] + xyz[1] + xyz[2];
        assert_close(xyz[0] / sum, known[i][1], known[i][3]);
        assert_close(xyz[1] / sum, known[i][2], known[i][3]);
    }
}

static void hotter_bodies_are_less_red_and_more_blue(void **state)
{
    (void)state;
    double before[3], rgb[3];
    trip_black_body(1000, before);
    for (double kelvin = 1100; kelvin < 40000; kelvin *= 1.1) {
        trip_black_body(kelvin, rgb);
        assert_true(fmax(rgb[0], fmax(rgb[1], rgb[2])) == 1);
        assert_true(rgb[0] <= before[0] && rgb[2] >= before[2]);
        for (int i = 0; i < 3; i++)
            before[i] = rgb[i];
    }
    assert_true(rgb[2] == 1 && rgb[0] < 0.5);
}

static void any_temperature_has_a_colour(void **state)
{
    (void)state;
    const double all[] = { 0, 1e-300, 1, 150, 1e5, 1e12 };
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        double rgb[3];
        trip_black_body(all[i], rgb);
        for (int k = 0; k < 3; k++)
            assert_true(rgb[k] >= 0 && rgb[k] <= 1);
        assert_true(all[i] > 1000 || (rgb[0] == 1 && rgb[1] < 0.1 && rgb[2] == 0));
    }
}

static void half_of_the_light_is_three_quarters_on_a_screen(void **state)
{
    (void)state;
    assert_close(trip_display_of_linear(0), 0, 0);
    assert_close(trip_display_of_linear(1), 1, 1e-12);
    assert_close(trip_display_of_linear(0.5), 0.735357, 1e-6);
    assert_close(trip_display_of_linear(0.0031308), 0.04045, 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(chromaticity_is_that_of_the_planckian_locus),
        cmocka_unit_test(hotter_bodies_are_less_red_and_more_blue),
        cmocka_unit_test(any_temperature_has_a_colour),
        cmocka_unit_test(half_of_the_light_is_three_quarters_on_a_screen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
