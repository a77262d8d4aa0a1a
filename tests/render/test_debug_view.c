/* Pictures that show the layers, lists or levels, compared with weights worked out by hand. */
#include "debug_view.h"

#include "test.h"

/* Returns a parallel view: all rays have one direction. */
static trip_camera along(trip_vec3 direction)
{
    const trip_affine m = trip_affine_identity();
    const trip_camera_params p = {
        .look = direction, .up = { 0, 0, 1 }, .ortho_height = 10, .width = 4, .height = 4
    };
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &p, &m), 0);
    return c;
}

static void assert_colour(const double rgb[3], double r, double g, double b)
{
    assert_close(rgb[0], r, 1e-12);
    assert_close(rgb[1], g, 1e-12);
    assert_close(rgb[2], b, 1e-12);
}

/* With h = 1/2, a list has the weight 2 (|r_a| / max - 1/2). */
static void layers_are_shown_by_their_share_of_the_merge(void **state)
{
    (void)state;
    const trip_camera camera = along(trip_v3(-0.75, 1, 0.4));
    trip_settings s = trip_settings_default();
    double rgb[3];
    s.h = 0.5;
    trip_debug_view_merge(&s, &camera, 1, 0.5, 2.5, rgb);
    assert_colour(rgb, 0.25 / 1.25, 1 / 1.25, 0);
    s.h = 0;
    trip_debug_view_merge(&s, &camera, 1, 0.5, 2.5, rgb);
    const double sum = 0.5625 + 1 + 0.16;
    assert_colour(rgb, 0.5625 / sum, 1 / sum, 0.16 / sum);
}

static void lists_have_the_colours_of_their_axes_and_levels_their_own(void **state)
{
    (void)state;
    trip_settings s = trip_settings_default();
    double rgb[3], last[3];
    assert_false(trip_debug_view_of(&s, 1, 0, rgb));
    s.show = TRIP_SHOW_LISTS;
    assert_true(trip_debug_view_of(&s, 1, 3, rgb));
    assert_colour(rgb, 0, 1, 0);
    s.show = TRIP_SHOW_LEVELS;
    for (unsigned level = 0; level < 7; level++) {
        assert_true(trip_debug_view_of(&s, 2, level, rgb));
        assert_true(level == 0 || memcmp(rgb, last, sizeof rgb) != 0);
        memcpy(last, rgb, sizeof last);
    }
    assert_true(trip_debug_view_of(&s, 0, 40, rgb));
    assert_memory_equal(rgb, last, sizeof rgb);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layers_are_shown_by_their_share_of_the_merge),
        cmocka_unit_test(lists_have_the_colours_of_their_axes_and_levels_their_own),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
