/* The mean colour of covered pixels and the background of the others, computed by hand. */
#include "normalise.h"

#include "test.h"

static const double background[4] = { 0.8, 0.4, 0.2, 0.5 };

static void assert_pixel(const float *rgba, double r, double g, double b, double a)
{
    const double expected[4] = { r, g, b, a };
    for (int c = 0; c < 4; c++)
        assert_close((double)rgba[c], expected[c], 1e-6);
}

static void covered_pixels_have_their_mean_colour_and_are_opaque(void **state)
{
    (void)state;
    float rgba[8] = { 0.1F, 0.2F, 0.05F, 0.25F, 4e-4F, 2e-4F, 0, 5e-4F };
    trip_normalise(rgba, 2, background);
    assert_pixel(rgba, 0.4, 0.8, 0.2, 1);
    assert_pixel(rgba + 4, 0.8, 0.4, 0, 1);
}

static void uncovered_pixels_show_the_premultiplied_background(void **state)
{
    (void)state;
    float rgba[8] = { 0, 0, 0, 0, 4e-5F, 4e-5F, 4e-5F, 5e-5F };
    trip_normalise(rgba, 2, background);
    assert_pixel(rgba, 0.4, 0.2, 0.1, 0.5);
    assert_pixel(rgba + 4, 0.4, 0.2, 0.1, 0.5);
}

static void the_background_is_visible_through_open_pixels(void **state)
{
    (void)state;
    float rgba[8] = { 0.1F, 0.2F, 0.05F, 0.25F, 0.3F, 0.6F, 0.9F, 1 };
    trip_put_behind(rgba, 2, background);
    assert_pixel(rgba, 0.1 + 0.75 * 0.4, 0.2 + 0.75 * 0.2, 0.05 + 0.75 * 0.1, 0.25 + 0.75 * 0.5);
    assert_pixel(rgba + 4, 0.3, 0.6, 0.9, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(covered_pixels_have_their_mean_colour_and_are_opaque),
        cmocka_unit_test(uncovered_pixels_show_the_premultiplied_background),
        cmocka_unit_test(the_background_is_visible_through_open_pixels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
