#include "test.h"

#include "camera_text.h"

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
    assert_options(trip_camera_text(&n, 640, 480),
                   "--eye 1,-2.5,0 --look 0,0,1e-20 --up 0,0,1 --fov 30 --size 640x480");
    n.ortho_height = 12.25;
    assert_options(trip_camera_text(&n, 1, 2),
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
        char *text = trip_camera_text(&n, 9, 9);
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
        cmocka_unit_test(a_view_is_written_as_options),
        cmocka_unit_test(numbers_are_written_without_loss),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
