/* Compares the CPU renderer with the reference, for each instruction set. Grids, views and
 * settings take different paths through the kernels. test_gl_views.c does the same with real data.
 */
#include "cpu/kernels/isa.h"
#include "cpu_scenes.h"
#include "test.h"

#include <stdlib.h>
#include <string.h>

static double mean_difference(const scene_picture *a, const scene_picture *b)
{
    double sum = 0;
    size_t n = 4 * (size_t)a->width * (size_t)a->height;
    for (size_t i = 0; i < n; i++)
        sum += fabs((double)a->rgba[i] - (double)b->rgba[i]);
    return sum / (double)n;
}

/* The maximum difference between instruction sets. They round alike except for fused products. */
#define SETS_DIFFER (0.05 / 255)

/* Checks every instruction set against the reference: within 1/255 everywhere, within 0.05/255 on
 * average, with the same counts. Instruction sets must also agree with each other. */
static void compare(const scene *s, const trip_camera_params *view, const trip_settings *settings)
{
    scene_picture expected = scene_draw(s, &cpu_scenes_reference, view, settings), first = { 0 };
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        scene_picture p = scene_draw(s, &cpu_scenes_cpu, view, settings);
        double max = scene_difference(&expected, &p), mean = mean_difference(&expected, &p);
        if (!(max <= 1.0 / 255 && mean <= 0.05 / 255))
            fail_msg("%s: most %.4f, mean %.5f of 1/255", (*isa)->isa, 255 * max, 255 * mean);
        for (int axis = 0; axis < 3 && settings->flatten <= 1; axis++)
            scene_compare_counts(&expected.lists[axis], &p.lists[axis], (*isa)->isa);
        if (first.rgba) {
            double apart = scene_difference(&first, &p);
            if (!(apart <= SETS_DIFFER))
                fail_msg("%s: %.4f of 1/255 from %s", (*isa)->isa, 255 * apart,
                         trip_cpu_isas()[0]->isa);
            scene_picture_free(&p);
        } else {
            first = p;
        }
    }
    scene_picture_free(&first);
    unsetenv("TRIPTYCH_ISA");
    scene_picture_free(&expected);
}

static void views_from_all_sides_agree_with_the_reference(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 16, NULL);
    trip_settings settings = trip_settings_default();
    for (int i = 0; i < 6; i++) {
        trip_vec3 from = { cos(1.1 * i), sin(1.1 * i), 0.5 * sin(3.3 * i) };
        trip_camera_params view = scene_view(&s, from, 70 - 8 * i, 50, 75 + i);
        compare(&s, &view, &settings);
    }
    scene_destroy(&s);
}

static void sheared_grids_agree_with_the_reference(void **state)
{
    (void)state;
    scene s;
    trip_affine sheared = cpu_scenes_sheared();
    cpu_scenes_blobs(&s, 32, &sheared);
    trip_settings settings = trip_settings_default();
    for (int i = 0; i < 4; i++) {
        trip_camera_params view =
            scene_view(&s, trip_v3(i - 1.5, 1, 0.4 * i - 0.7), 80 - 15 * i, 55, 80);
        view.ortho_height = i % 2 ? 50 : 0;
        compare(&s, &view, &settings);
    }
    scene_destroy(&s);
}

static void inside_and_wide_views_agree_with_the_reference(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 16, NULL);
    trip_settings settings = trip_settings_default();
    for (int i = 0; i < 3; i++) {
        trip_camera_params view =
            scene_view(&s, trip_v3(1, 0.3 * i, 0.2), 6 - 2 * i, 100 + 30 * i, 64);
        compare(&s, &view, &settings);
    }
    scene_destroy(&s);
}

/* Draws EWA footprints, round and flat, from outside and inside, with both traversals. */
static void affine_footprints_agree_with_the_reference(void **state)
{
    (void)state;
    const trip_affine sheared = cpu_scenes_sheared();
    for (int i = 0; i < 6; i++) {
        scene s;
        cpu_scenes_blobs(&s, 16, i % 2 ? &sheared : NULL);
        trip_settings settings = trip_settings_default();
        settings.footprint = TRIP_FOOTPRINT_EWA;
        settings.traversal = i < 4 ? TRIP_TRAVERSAL_OUTWARD : TRIP_TRAVERSAL_ASCENDING;
        settings.flatten = i == 3 || i == 4 ? 6 : 1;
        trip_camera_params view =
            scene_view(&s, trip_v3(1, 0.3 * i, 0.2), i < 2 ? 5 : 60, i < 2 ? 110 : 50, 64);
        view.ortho_height = i == 4 ? 50 : 0;
        compare(&s, &view, &settings);
        scene_destroy(&s);
    }
}

static void a_voxel_may_cover_many_panes_and_many_voxels_a_pixel(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 16, NULL);
    trip_settings settings = trip_settings_default();
    trip_camera_params near = scene_view(&s, trip_v3(0.3, 1, 0.2), 30, 4, 100);
    compare(&s, &near, &settings);
    trip_camera_params far = scene_view(&s, trip_v3(0.3, 1, 0.2), 900, 30, 33);
    compare(&s, &far, &settings);
    scene_destroy(&s);
}

static void every_method_and_traversal_agrees_with_the_reference(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 16, NULL);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.9, -0.8), 60, 50, 70);
    for (int i = 0; i < 24; i++) {
        trip_settings settings = trip_settings_default();
        settings.method = (trip_method)(i % 3);
        settings.traversal = i / 3 % 2 ? TRIP_TRAVERSAL_ASCENDING : TRIP_TRAVERSAL_OUTWARD;
        settings.h = i / 6 % 2 ? 0.95 : 0;
        settings.compositing = i < 12 ? TRIP_COMPOSITING_SPLAT : TRIP_COMPOSITING_SHEET;
        view.ortho_height = i % 4 == 3 ? 50 : 0;
        compare(&s, &view, &settings);
    }
    scene_destroy(&s);
}

/* Weights are differences from h. Here they are half of the range from h to 1. */
static void lists_with_h_close_to_1_merge_like_the_reference(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 16, NULL);
    for (int i = 3; i <= 6; i++) {
        double left = pow(10, -i);
        trip_settings settings = trip_settings_default();
        trip_camera_params view = scene_view(&s, trip_v3(1, 1 - 0.5 * left, 0.6), 60, 50, 70);
        view.ortho_height = 50;
        settings.h = 1 - left;
        compare(&s, &view, &settings);
    }
    scene_destroy(&s);
}

static void kernels_light_and_background_agree_with_the_reference(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 16, NULL);
    trip_camera_params view = scene_view(&s, trip_v3(-1, 0.4, 0.6), 60, 45, 64);
    for (int i = 0; i < 5; i++) {
        const double radii[5] = { 0.5, 1, 1.7, 3, 5 };
        trip_settings settings = trip_settings_default();
        settings.kernel_radius = radii[i];
        settings.shading = i != 2;
        settings.headlight = i % 2 == 0;
        settings.light_direction =
            trip_normalize(i == 3 ? trip_v3(1, -0.2, -0.4) : trip_v3(0.3, -0.8, 0.5));
        for (int c = 0; c < 4; c++)
            settings.background[c] = 0.2 + 0.15 * c;
        compare(&s, &view, &settings);
    }
    scene_destroy(&s);
}

static void images_of_any_size_are_filled_to_their_edges(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 16, NULL);
    const int sizes[5][2] = { { 1, 1 }, { 33, 7 }, { 31, 64 }, { 128, 1 }, { 5, 97 } };
    for (int i = 0; i < 5; i++) {
        trip_settings settings = trip_settings_default();
        trip_camera_params view = scene_view(&s, trip_v3(0.2, 0.1, 1), 25, 60, 1);
        view.width = sizes[i][0];
        view.height = sizes[i][1];
        compare(&s, &view, &settings);
    }
    scene_destroy(&s);
}

static void an_instruction_set_this_machine_lacks_is_refused(void **state)
{
    (void)state;
    trip_budget *budget;
    trip_renderer *r;
    assert_int_equal(trip_budget_create(&budget, UINT64_C(1) << 28), 0);
    setenv("TRIPTYCH_ISA", "mmx", 1);
    test_catch_reports();
    assert_int_equal(trip_cpu_create(&r, budget, 1), TRIP_USAGE);
    assert_one_report("TRIPTYCH_ISA: 'mmx' does not run here; choose one of ");
    assert_null(r);
    unsetenv("TRIPTYCH_ISA");
    trip_budget_destroy(budget);
}

static void too_little_memory_is_refused(void **state)
{
    (void)state;
    trip_budget *budget;
    trip_renderer *r;
    assert_int_equal(trip_budget_create(&budget, 100000), 0);
    test_catch_reports();
    assert_int_equal(trip_cpu_create(&r, budget, 2), TRIP_ERROR);
    assert_one_report("2 threads do not fit the memory given; raise --memory");
    assert_null(r);
    assert_int_equal(trip_budget_left_bytes(budget), 100000);
    trip_budget_destroy(budget);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(views_from_all_sides_agree_with_the_reference),
        cmocka_unit_test(sheared_grids_agree_with_the_reference),
        cmocka_unit_test(inside_and_wide_views_agree_with_the_reference),
        cmocka_unit_test(affine_footprints_agree_with_the_reference),
        cmocka_unit_test(a_voxel_may_cover_many_panes_and_many_voxels_a_pixel),
        cmocka_unit_test(every_method_and_traversal_agrees_with_the_reference),
        cmocka_unit_test(lists_with_h_close_to_1_merge_like_the_reference),
        cmocka_unit_test(kernels_light_and_background_agree_with_the_reference),
        cmocka_unit_test(images_of_any_size_are_filled_to_their_edges),
        cmocka_unit_test(an_instruction_set_this_machine_lacks_is_refused),
        cmocka_unit_test(too_little_memory_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
