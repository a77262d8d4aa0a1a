/* Turns the camera in steps of 0.05 degrees across the direction at which the most aligned list
 * changes. With one list per frame the picture jumps; with lists per pixel it does not. */
#include "hard.h"
#include "test.h"

#include <stdlib.h>

enum { SIZE = 32, STEPS = 16 };

static trip_camera_params view_at(double degrees)
{
    const double angle = degrees * 3.14159265358979323846 / 180, c = 6.5;
    return (trip_camera_params){ .look = { c, c, c },
                                 .eye = { c + 40 * cos(angle), c + 40 * sin(angle), c + 9 },
                                 .up = { 0, 0, 1 },
                                 .fov_degrees = 22,
                                 .width = SIZE,
                                 .height = SIZE };
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Returns the largest mean change of a component over all steps, divided by the median step.
 * Motion causes the median step. */
static double max_over_median(const scene *s, trip_method method, double h, unsigned form)
{
    double changes[STEPS];
    hard_view v = { .settings = hard_settings() };
    v.settings.method = method;
    v.settings.h = h;
    scene_picture before = { 0 };
    for (int i = 0; i <= STEPS; i++) {
        v.camera = view_at(45 + 0.05 * (i - 0.5 * STEPS + 0.25));
        scene_picture p = hard_draw(s, &cpu_scenes_cpu, &v, form);
        double sum = 0;
        for (int k = 0; k < 4 * SIZE * SIZE && i > 0; k++)
            sum += fabs((double)p.rgba[k] - (double)before.rgba[k]);
        if (i > 0)
            changes[i - 1] = sum;
        scene_picture_free(&before);
        before = p;
    }
    scene_picture_free(&before);
    qsort(changes, STEPS, sizeof *changes, ascending);
    assert_true(changes[STEPS / 2] > 0);
    return changes[STEPS - 1] / changes[STEPS / 2];
}

/* The median step is 1 in these ratios, so that 1 means no jump. With `clip`, the border between
 * two lists crosses one of 32 pixel columns at a time, which leaves a small jump. */
static void one_list_a_frame_pops_and_lists_by_pixel_do_not(void **state)
{
    (void)state;
    scene s;
    hard_lumps(&s, (const int64_t[3]){ 14, 14, 14 }, NULL);
    for (unsigned form = HARD_SPLATS; form <= HARD_POST; form *= 2) {
        double axis = max_over_median(&s, TRIP_METHOD_AXIS, 0, form);
        double clip = max_over_median(&s, TRIP_METHOD_CLIP, 0, form);
        print_message("form %u: axis %.2f, clip %.2f\n", form, axis, clip);
        assert_true(axis > 10);
        assert_true(clip < axis / 8);
        const double hs[] = { 0, 0.85, 0.99 }, max[] = { 1.5, 1.5, 2 };
        for (int i = 0; i < 3; i++) {
            double merge = max_over_median(&s, TRIP_METHOD_MERGE, hs[i], form);
            print_message("  merge, h %g: %.2f\n", hs[i], merge);
            assert_true(merge < max[i]);
        }
    }
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_list_a_frame_pops_and_lists_by_pixel_do_not),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
