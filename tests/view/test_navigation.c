#include "test.h"

#include "navigation.h"

enum { WIDTH = 640, HEIGHT = 480 };

#define PI 3.14159265358979323846

/* Returns a view from (0, -10, 0) to the origin. z is up and x is to the right. */
static trip_navigation front(void)
{
    const triptych_camera camera = {
        .eye = { 0, -10, 0 }, .up = { 0, 0, 1 }, .fov_degrees = 60, .width = WIDTH, .height = HEIGHT
    };
    return trip_navigation_from_camera(&camera, NULL);
}

static trip_navigation oblique(bool parallel)
{
    const triptych_camera camera = { .eye = { 3, -7, 4 },
                                     .look = { 1, 2, -1 },
                                     .up = { 0.1, 0.2, 1 },
                                     .fov_degrees = 40,
                                     .ortho_height = parallel ? 5 : 0 };
    return trip_navigation_from_camera(&camera, (const double[3]){ 0, 0, 2 });
}

static void assert_point(const double p[3], double x, double y, double z)
{
    assert_close(p[0], x, 1e-12);
    assert_close(p[1], y, 1e-12);
    assert_close(p[2], z, 1e-12);
}

static void assert_pixel(const trip_navigation *n, const double p[3], double x, double y)
{
    double pixel[2];
    trip_navigation_project(n, WIDTH, HEIGHT, p, pixel);
    assert_close(pixel[0], x, 1e-9);
    assert_close(pixel[1], y, 1e-9);
}

static void a_view_points_to_the_members_of_the_state(void **state)
{
    (void)state;
    trip_navigation n = oblique(false);
    triptych_view v = trip_navigation_view(&n, 3, 4);
    assert_ptr_equal(v.eye, n.eye);
    assert_ptr_equal(v.look, n.look);
    assert_ptr_equal(v.up, n.up);
    assert_int_equal(v.width, 3);
    assert_int_equal(v.height, 4);
    assert_true(v.fov_degrees == 40 && v.ortho_height == 0);
    assert_point(n.upright, 0, 0, 1);
}

static void points_are_projected_in_perspective_and_in_parallel(void **state)
{
    (void)state;
    trip_navigation n = front();
    double k = HEIGHT / 2 / tan(PI / 6); /* px per unit at distance 1 */
    assert_pixel(&n, (const double[3]){ 0, 0, 0 }, WIDTH / 2, HEIGHT / 2);
    assert_pixel(&n, (const double[3]){ 1, 0, 2 }, WIDTH / 2 + k / 10, HEIGHT / 2 - 2 * k / 10);
    assert_pixel(&n, (const double[3]){ 1, -5, 0 }, WIDTH / 2 + k / 5, HEIGHT / 2);
    trip_navigation_set_parallel(&n, true);
    assert_close(n.ortho_height, 20 * tan(PI / 6), 1e-12);
    assert_pixel(&n, (const double[3]){ 1, -5, 0 }, WIDTH / 2 + k / 10, HEIGHT / 2);
}

static void points_of_a_pixel_project_onto_it(void **state)
{
    (void)state;
    for (int parallel = 0; parallel < 2; parallel++) {
        trip_navigation n = oblique(parallel);
        const double pixel[2] = { 17.5, 400.25 };
        double p[3], q[2];
        trip_navigation_point(&n, WIDTH, HEIGHT, pixel, 6, p);
        assert_close(trip_navigation_project(&n, WIDTH, HEIGHT, p, q), 6, 1e-12);
        assert_close(q[0], pixel[0], 1e-10);
        assert_close(q[1], pixel[1], 1e-10);
    }
}

static void an_orbit_moves_the_eye_around_the_look_point(void **state)
{
    (void)state;
    trip_navigation n = front();
    trip_navigation_orbit(&n, 90, 0);
    assert_point(n.eye, 10, 0, 0);
    trip_navigation_orbit(&n, 0, 30);
    assert_point(n.eye, 10 * cos(PI / 6), 0, 5);
    assert_point(n.look, 0, 0, 0);
    for (int i = 0; i < 100; i++)
        trip_navigation_orbit(&n, 7.3, -11.9);
    assert_close(trip_navigation_distance(&n), 10, 1e-12);
    assert_point(n.look, 0, 0, 0);
}

static void an_orbit_passes_over_the_top(void **state)
{
    (void)state;
    trip_navigation n = front();
    trip_navigation_orbit(&n, 0, 135);
    assert_point(n.eye, 0, 10 * sin(PI / 4), 10 * sin(PI / 4));
    assert_true(n.up[2] < 0);
    /* In a view upside down, near points still follow a drag. */
    trip_navigation_orbit(&n, 90, 0);
    assert_point(n.eye, 10 * sin(PI / 4), 0, 10 * sin(PI / 4));
}

static void a_grabbed_point_stays_under_the_cursor(void **state)
{
    (void)state;
    for (int parallel = 0; parallel < 2; parallel++) {
        trip_navigation n = oblique(parallel);
        const double p[3] = { 1.5, 1, 0.25 };
        double before[2], depth = trip_navigation_project(&n, WIDTH, HEIGHT, p, before);
        trip_navigation_pan(&n, 31, -12.5, HEIGHT, depth);
        assert_pixel(&n, p, before[0] + 31, before[1] - 12.5);
    }
}

static void a_dolly_goes_to_the_point_under_the_cursor(void **state)
{
    (void)state;
    for (int parallel = 0; parallel < 2; parallel++) {
        trip_navigation n = oblique(parallel);
        const double p[3] = { 1.5, 1, 0.25 };
        double pixel[2], again[2], depth = trip_navigation_project(&n, WIDTH, HEIGHT, p, pixel);
        double size = trip_navigation_pixel(&n, HEIGHT, depth);
        trip_navigation_dolly(&n, 0.5, p);
        assert_close(trip_navigation_project(&n, WIDTH, HEIGHT, p, again), depth / 2, 1e-12);
        assert_close(again[0], pixel[0], 1e-10);
        assert_close(again[1], pixel[1], 1e-10);
        assert_close(trip_navigation_pixel(&n, HEIGHT, depth / 2), size / 2, 1e-12);
    }
}

static void flying_moves_the_eye_and_the_look_point(void **state)
{
    (void)state;
    trip_navigation n = front();
    trip_navigation_fly(&n, 25, 2, -3);
    assert_point(n.eye, 2, 15, -3);
    assert_point(n.look, 2, 25, -3);
}

static void turning_keeps_the_eye(void **state)
{
    (void)state;
    trip_navigation n = front();
    trip_navigation_turn(&n, 90, 0);
    assert_point(n.eye, 0, -10, 0);
    assert_point(n.look, 10, -10, 0);
    trip_navigation_turn(&n, 0, 30);
    assert_point(n.look, 10 * cos(PI / 6), -10, 5);
}

static void an_upside_down_view_also_turns_to_the_right_of_the_picture(void **state)
{
    (void)state;
    trip_navigation n = front();
    trip_navigation_roll(&n, 180); /* now -x is to the right */
    trip_navigation_turn(&n, 90, 0);
    assert_point(trip_navigation_get_axes(&n).forward, -1, 0, 0);
    assert_point(trip_navigation_get_axes(&n).up, 0, 0, -1);
}

static void a_roll_turns_the_picture_clockwise(void **state)
{
    (void)state;
    trip_navigation n = front();
    const double up[3] = { 0, 0, 1 };
    double k = HEIGHT / 2 / tan(PI / 6) / 10;
    trip_navigation_roll(&n, 90);
    assert_pixel(&n, up, WIDTH / 2 + k, HEIGHT / 2); /* the top is now on the right */
}

static void another_field_of_view_keeps_the_size_at_the_look_point(void **state)
{
    (void)state;
    trip_navigation n = front();
    const double p[3] = { 1, 0, 1 };
    double pixel[2];
    trip_navigation_project(&n, WIDTH, HEIGHT, p, pixel);
    trip_navigation_set_fov(&n, 20);
    assert_close(trip_navigation_distance(&n), 10 * tan(PI / 6) / tan(PI / 18), 1e-12);
    assert_pixel(&n, p, pixel[0], pixel[1]);
    trip_navigation_set_parallel(&n, true);
    assert_pixel(&n, p, pixel[0], pixel[1]);
    trip_navigation_set_fov(&n, 90);
    assert_pixel(&n, p, pixel[0], pixel[1]);
    trip_navigation_set_parallel(&n, false);
    assert_close(trip_navigation_distance(&n), 10 * tan(PI / 6), 1e-12);
    assert_pixel(&n, p, pixel[0], pixel[1]);
}

static void views_of_the_sides_are_upright(void **state)
{
    (void)state;
    trip_navigation n = oblique(false);
    double distance = trip_navigation_distance(&n);
    trip_navigation_look_from(&n, (const double[3]){ -3, 0, 0 });
    assert_point(n.eye, 1 - distance, 2, -1);
    assert_point(trip_navigation_get_axes(&n).up, 0, 0, 1);
    assert_point(trip_navigation_get_axes(&n).right, 0, -1, 0);
    trip_navigation_look_from(&n, (const double[3]){ 0, 0, 1 });
    assert_point(n.eye, 1, 2, distance - 1);
    assert_point(trip_navigation_get_axes(&n).up, 0, 1, 0);
    assert_point(trip_navigation_get_axes(&n).right, 1, 0, 0);
}

/* Checks that all corners project into the central part of the picture, `fill` of its sides. The
 * corners must touch two opposite borders of this part. */
static void assert_fits(const trip_navigation *n, const double lo[3], const double hi[3], int width,
                        double fill)
{
    double x0 = INFINITY, x1 = -INFINITY, y0 = INFINITY, y1 = -INFINITY;
    for (int i = 0; i < 8; i++) {
        const double p[3] = { i & 1 ? hi[0] : lo[0], i & 2 ? hi[1] : lo[1], i & 4 ? hi[2] : lo[2] };
        double q[2];
        assert_true(trip_navigation_project(n, width, HEIGHT, p, q) > 0);
        x0 = fmin(x0, q[0] / width);
        x1 = fmax(x1, q[0] / width);
        y0 = fmin(y0, q[1] / HEIGHT);
        y1 = fmax(y1, q[1] / HEIGHT);
    }
    double margin = (1 - fill) / 2, near = 1e-9;
    assert_true(x0 > margin - near && x1 < 1 - margin + near);
    assert_true(y0 > margin - near && y1 < 1 - margin + near);
    bool wide = fabs(x0 - margin) < near && fabs(x1 - 1 + margin) < near;
    bool high = fabs(y0 - margin) < near && fabs(y1 - 1 + margin) < near;
    assert_true(wide || high);
}

static void a_box_is_fitted_exactly(void **state)
{
    (void)state;
    const double lo[3] = { -4, 10, 3 }, hi[3] = { 8, 13, 4 };
    static const int widths[] = { 100, 480, 2000 };
    for (int parallel = 0; parallel < 2; parallel++)
        for (int i = 0; i < 3; i++) {
            trip_navigation n = oblique(parallel);
            trip_navigation_axes axes = trip_navigation_get_axes(&n);
            trip_navigation_fit(&n, lo, hi, widths[i], HEIGHT, 0.9);
            assert_fits(&n, lo, hi, widths[i], 0.9);
            trip_navigation_axes after = trip_navigation_get_axes(&n);
            assert_point(after.forward, axes.forward[0], axes.forward[1], axes.forward[2]);
        }
}

static void movements_to_invalid_views_do_nothing(void **state)
{
    (void)state;
    trip_navigation n = oblique(false), before = n;
    trip_navigation_dolly(&n, 0, n.look);
    trip_navigation_dolly(&n, NAN, n.look);
    trip_navigation_dolly(&n, INFINITY, n.look);
    trip_navigation_dolly(&n, 1e-300, n.look);
    trip_navigation_fly(&n, INFINITY, 0, 0);
    trip_navigation_set_fov(&n, 180);
    trip_navigation_set_fov(&n, NAN);
    trip_navigation_look_from(&n, (const double[3]){ 0, 0, 0 });
    trip_navigation_orbit(&n, NAN, 0);
    assert_memory_equal(&n, &before, sizeof n);
}

/* A dolly does nothing if the height of the parallel view would then be outside 1e-100 to 1e100. */
static void heights_of_parallel_views_stay_within_bounds(void **state)
{
    (void)state;
    const struct {
        double height, factor;
        bool taken;
    } steps[] = { { 2e-100, 0.4, false }, { 3e-100, 0.5, true }, { 4e99, 3, false },
                  { 4e99, 2, true },      { 1e-101, 5, false },  { 1e-101, 20, true },
                  { 1e101, 0.2, false },  { 1e101, 0.05, true } };
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        trip_navigation n = oblique(true);
        n.ortho_height = steps[i].height;
        const trip_navigation before = n;
        trip_navigation_dolly(&n, steps[i].factor, (const double[3]){ 1.5, 1, 0.25 });
        if (steps[i].taken)
            assert_true(n.ortho_height == steps[i].height * steps[i].factor);
        else
            assert_memory_equal(&n, &before, sizeof n);
    }
}

/* When the eye has reached its minimum distance, the height of the view stays too. */
static void the_height_of_a_parallel_view_follows_the_distance(void **state)
{
    (void)state;
    trip_navigation n = oblique(true);
    const double seen = n.ortho_height / trip_navigation_distance(&n);
    for (int i = 0; i < 200; i++)
        trip_navigation_dolly(&n, 0.5, n.look);
    const double ratio = n.ortho_height / trip_navigation_distance(&n) / seen;
    assert_true(ratio > 0.25 && ratio < 4);
}

static void a_dolly_can_always_leave_the_look_point_again(void **state)
{
    (void)state;
    trip_navigation n = oblique(false);
    for (int i = 0; i < 1000; i++)
        trip_navigation_dolly(&n, 0.5, n.look);
    assert_true(trip_navigation_distance(&n) > 0);
    for (int i = 0; i < 1000; i++)
        trip_navigation_dolly(&n, 2, n.look);
    assert_true(isfinite(trip_navigation_distance(&n)));
    assert_close(n.look[0], 1, 1e-12);
}

static void assert_options(char *text, const char *expected)
{
    assert_string_equal(text, expected);
    free(text);
}

static void a_view_is_written_as_options(void **state)
{
    (void)state;
    trip_navigation n = {
        .eye = { 1, -2.5, 0 }, .look = { 0, 0, 1e-20 }, .up = { 0, 0, 1 }, .fov_degrees = 30
    };
    assert_options(trip_navigation_options(&n, 640, 480),
                   "--eye 1,-2.5,0 --look 0,0,1e-20 --up 0,0,1 --fov 30 --size 640x480");
    n.ortho_height = 12.25;
    assert_options(trip_navigation_options(&n, 1, 2),
                   "--eye 1,-2.5,0 --look 0,0,1e-20 --up 0,0,1 --ortho 12.25 --size 1x2");
}

/* Numbers that are read back have the same bits. */
static void numbers_are_written_without_loss(void **state)
{
    (void)state;
    for (int i = 0; i < 1000; i++) {
        trip_navigation n = { .fov_degrees = 180 * test_random(), .ortho_height = 0 };
        double got[10], *numbers[] = { n.eye, n.look, n.up };
        for (int v = 0; v < 9; v++)
            numbers[v / 3][v % 3] = ldexp(test_random() - 0.5, (int)(80 * test_random()) - 40);
        char *text = trip_navigation_options(&n, 9, 9);
        assert_int_equal(
            sscanf(text, "--eye %lf,%lf,%lf --look %lf,%lf,%lf --up %lf,%lf,%lf --fov %lf", &got[0],
                   &got[1], &got[2], &got[3], &got[4], &got[5], &got[6], &got[7], &got[8], &got[9]),
            10);
        assert_memory_equal(got, n.eye, sizeof n.eye);
        assert_memory_equal(got + 3, n.look, sizeof n.look);
        assert_memory_equal(got + 6, n.up, sizeof n.up);
        assert_true(got[9] == n.fov_degrees);
        free(text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_view_points_to_the_members_of_the_state),
        cmocka_unit_test(points_are_projected_in_perspective_and_in_parallel),
        cmocka_unit_test(points_of_a_pixel_project_onto_it),
        cmocka_unit_test(an_orbit_moves_the_eye_around_the_look_point),
        cmocka_unit_test(an_orbit_passes_over_the_top),
        cmocka_unit_test(a_grabbed_point_stays_under_the_cursor),
        cmocka_unit_test(a_dolly_goes_to_the_point_under_the_cursor),
        cmocka_unit_test(flying_moves_the_eye_and_the_look_point),
        cmocka_unit_test(turning_keeps_the_eye),
        cmocka_unit_test(an_upside_down_view_also_turns_to_the_right_of_the_picture),
        cmocka_unit_test(a_roll_turns_the_picture_clockwise),
        cmocka_unit_test(another_field_of_view_keeps_the_size_at_the_look_point),
        cmocka_unit_test(views_of_the_sides_are_upright),
        cmocka_unit_test(a_box_is_fitted_exactly),
        cmocka_unit_test(movements_to_invalid_views_do_nothing),
        cmocka_unit_test(heights_of_parallel_views_stay_within_bounds),
        cmocka_unit_test(the_height_of_a_parallel_view_follows_the_distance),
        cmocka_unit_test(a_dolly_can_always_leave_the_look_point_again),
        cmocka_unit_test(a_view_is_written_as_options),
        cmocka_unit_test(numbers_are_written_without_loss),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
