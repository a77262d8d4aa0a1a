/* Frames of coarse levels with deviations. Compares the pictures of every renderer with closed
 * forms, and the CPU renderer with the reference. Threads, memory and tiles must not change a bit.
 * test_gl_levels.c tests gl further. */
#include "cpu/cpu_renderer.h"
#include "cpu/kernels/isa.h"
#include "cpu_scenes.h"
#include "deviation.h"
#include "kernel.h"
#include "level_scenes.h"
#include "plan.h"
#include "splat.h"
#include "test.h"

#include <stdlib.h>
#include <string.h>

enum { PIXELS = TEST_BY_TURNS ? 40 : 72 };

/* ---- closed forms ---- */

/* A constant value with a constant deviation. */
typedef struct even {
    unsigned code, deviation;
} even;

static bool even_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const even *e = user;
    (void)i, (void)j, (void)k, (void)gradient;
    *code = e->code;
    return true;
}

static unsigned even_deviation(void *user, int i, int j, int k)
{
    const even *e = user;
    (void)i, (void)j, (void)k;
    return e->deviation;
}

/* Returns the share of a normal distribution above a threshold. */
static double share_above(double threshold, const even *e)
{
    const double deviation = trip_deviation(e->deviation);
    return 0.5 * erfc((threshold - e->code) / deviation * sqrt(0.5));
}

/* Codes from THRESHOLD on have a constant extinction. Blurred, the extinction of a value is in
 * proportion to the share of its distribution above the threshold. The tested deviations are rows
 * of the blurred function, up to the rounding of their codes. */
static void a_step_has_the_mean_extinction_of_the_distribution(void **state)
{
    (void)state;
    enum { THRESHOLD = 40000, LENGTH = 24 };
    const even cases[] = { { 36000, 64 },  { 40500, 95 }, { 20000, 189 },
                           { 45000, 133 }, { 39900, 16 }, { 30000, 255 } };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        even e = cases[i];
        level_scene l;
        level_scene_create(
            &l, &(level_contents){ even_voxel, even_deviation, &e, .dims = { 32, 32, LENGTH } });
        scene_colour(&l.of, THRESHOLD, 65535, 1, 0.5, 0.25, 0.05);
        level_scene_use_colours(&l);
        trip_camera_params view = scene_view(&l.at, trip_v3(0, 0, 1), 300, 40, PIXELS);
        view.ortho_height = 40;
        const trip_settings settings = level_scene_settings();
        const double depth =
            l.at.table[65535].extinction * share_above(THRESHOLD - 0.5, &e) * 2 * (LENGTH - 1);
        scene_turn turn = scene_turns(scene_renderers_post(), &l.at, &view, &settings);
        while (scene_take_turn(&turn)) {
            const float *pixel = scene_pixel(&turn.picture, PIXELS / 2, PIXELS / 2);
            assert_close(pixel[3], 1 - exp(-depth), 0.004);
            assert_close(pixel[1], 0.5 * (1 - exp(-depth)), 0.004);
        }
        level_scene_destroy(&l);
    }
}

/* Bands of different colours: the colour is the mean, weighted by extinction. */
static void colours_are_weighted_by_extinction(void **state)
{
    (void)state;
    enum { LENGTH = 16 };
    even e = { 30000, 128 };
    level_scene l;
    level_scene_create(
        &l, &(level_contents){ even_voxel, even_deviation, &e, .dims = { 32, 32, LENGTH } });
    scene_colour(&l.of, 0, 29999, 1, 0, 0, 0.02);
    scene_colour(&l.of, 30000, 65535, 0, 0, 1, 0.08);
    level_scene_use_colours(&l);
    const double red = l.of.table[0].extinction * (1 - share_above(29999.5, &e));
    const double blue = l.of.table[65535].extinction * share_above(29999.5, &e);
    const double alpha = 1 - exp(-(red + blue) * 2 * (LENGTH - 1));
    trip_camera_params view = scene_view(&l.at, trip_v3(0, 0, 1), 300, 40, PIXELS);
    view.ortho_height = 40;
    const trip_settings settings = level_scene_settings();
    scene_turn turn = scene_turns(scene_renderers_post(), &l.at, &view, &settings);
    while (scene_take_turn(&turn)) {
        const float *pixel = scene_pixel(&turn.picture, PIXELS / 2, PIXELS / 2);
        assert_close(pixel[3], alpha, 0.003);
        assert_close(pixel[0], alpha * red / (red + blue), 0.003);
        assert_close(pixel[2], alpha * blue / (red + blue), 0.003);
    }
    level_scene_destroy(&l);
}

/* ---- the renderers agree ---- */

static double compare(const level_scene *l, const trip_camera_params *view,
                      const trip_settings *settings)
{
    scene_picture a = scene_draw(&l->at, &cpu_scenes_reference, view, settings);
    scene_picture b = scene_draw(&l->at, &cpu_scenes_cpu, view, settings);
    const double difference = scene_difference(&a, &b);
    assert_true(scene_max_opaque(&a) > 0.5);
    scene_picture_free(&a);
    scene_picture_free(&b);
    return difference;
}

/* Samples take the nearest entry of a row, and deviations are rounded between sheets. */
#define ROUNDING (1.0 / 255)

static void cpu_agrees_with_the_reference(void **state)
{
    (void)state;
    level_scene l;
    level_scene_waves(&l, &level_waves);
    for (int number = 0; number < 3; number++) {
        const trip_camera_params view = level_scene_view(&l, number, PIXELS);
        for (int kind = 0; kind < 5; kind++) {
            trip_settings settings = level_scene_settings();
            settings.shading = kind == 1;
            settings.depth = kind == 2;
            settings.effects.cueing = kind == 3 ? 0.5 : 0;
            settings.samples_per_sheet = kind == 4 ? 3 : 2;
            if (kind == 4)
                trip_clip_add(&settings.clip, trip_v3(1, 0.3, 0.2), -40);
            assert_close(compare(&l, &view, &settings), 0, scene_bound(&settings) + ROUNDING);
        }
        trip_settings cubic = level_scene_settings();
        cubic.kernel = TRIP_KERNEL_CUBIC;
        assert_close(compare(&l, &view, &cubic), 0, scene_bound(&cubic) + ROUNDING);
    }
    level_scene_destroy(&l);
}

/* Deviations add up to 4/255, because samples take the nearest entry of a row. */
static void codes_beyond_the_table_agree_with_the_reference(void **state)
{
    (void)state;
    level_scene l;
    level_scene_blocks(&l);
    for (int number = 0; number < 3; number++) {
        const trip_camera_params view = level_scene_view(&l, number, PIXELS);
        for (int kind = 0; kind < 4; kind++) {
            trip_settings settings = level_scene_settings();
            settings.kernel = TRIP_KERNEL_CUBIC;
            settings.deviations = kind < 2;
            settings.shading = kind % 2;
            if (kind % 2)
                trip_clip_add(&settings.clip, trip_v3(1, 0.3, 0.2), -40);
            const double difference = compare(&l, &view, &settings);
            print_message("view %d, kind %d: %.3f/255\n", number, kind, 255 * difference);
            assert_close(difference, 0, scene_bound(&settings) + (kind < 2 ? 4.0 / 255 : 0));
        }
    }
    level_scene_destroy(&l);
}

/* A function that shows values only by their deviations. */
static void values_that_only_deviations_show_are_drawn(void **state)
{
    (void)state;
    level_scene l;
    level_scene_create(&l, &level_waves);
    scene_colour(&l.of, 100, 4000, 1, 0.5, 0.25, 0.4); /* below all values */
    level_scene_use_colours(&l);
    const trip_settings settings = level_scene_settings();
    for (int number = 0; number < 3; number++) {
        const trip_camera_params view = level_scene_view(&l, number, PIXELS);
        scene_picture a = scene_draw(&l.at, &cpu_scenes_reference, &view, &settings);
        scene_picture b = scene_draw(&l.at, &cpu_scenes_cpu, &view, &settings);
        assert_true(scene_max_opaque(&a) > 0.03);
        assert_close(scene_difference(&a, &b), 0, scene_bound(&settings) + ROUNDING);
        scene_picture_free(&a);
        scene_picture_free(&b);
    }
    level_scene_destroy(&l);
}

/* All values are the same and not visible. Voxels beyond a border have a deviation that shows
 * them. */
static unsigned deviation_beyond(void *user, int i, int j, int k)
{
    const int *border = user;
    (void)j, (void)k;
    return i >= *border ? 160 : 0;
}

static bool unseen_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)i, (void)j, (void)k, (void)gradient;
    *code = 30000;
    return true;
}

/* The frame reads only the bricks beyond the border, and their neighbours. */
static void bricks_out_of_reach_are_transparent(void **state)
{
    (void)state;
    int border = 80;
    level_scene l;
    level_scene_create(&l, &(level_contents){ unseen_voxel, deviation_beyond, &border, 16,
                                              .dims = { 128, 32, 16 } });
    scene_colour(&l.of, 40000, 65535, 1, 0.5, 0.25, 0.2);
    level_scene_use_colours(&l);
    trip_camera_params view = scene_view(&l.at, trip_v3(0, 0, 1), 600, 40, PIXELS);
    view.ortho_height = 270;
    trip_settings settings = level_scene_settings();
    trip_camera camera;
    trip_plan plan;
    assert_int_equal(trip_camera_make(&camera, &view, &l.at.data->index_to_world), 0);
    assert_int_equal(trip_plan_make(&plan, l.at.data, &camera, &settings, l.at.table, l.at.budget),
                     0);
    assert_true(plan.blurs);
    const trip_list *list = trip_dataset_find(l.at.data, 2, 0, TRIP_KIND_VALUES);
    const trip_plan_list *planned = &plan.lists[list->index];
    /* Along z: 8 tiles along i, 2 along j, 2 slabs. The tiles from voxel 80 on, and one more. */
    assert_int_equal(planned->bricks, 8 * 2 * 2);
    assert_int_equal(planned->bricks_transparent, 4 * 2 * 2);
    assert_int_equal(planned->bricks_selected, 4 * 2 * 2);
    trip_plan_release(&plan, l.at.budget);
    const even e = { 30000, 160 };
    const double depth = l.at.table[65535].extinction * share_above(39999.5, &e) * 2 * 15;
    scene_turn turn = scene_turns(scene_renderers_post(), &l.at, &view, &settings);
    while (scene_take_turn(&turn)) {
        const float *seen = scene_pixel(&turn.picture, PIXELS / 2 + PIXELS / 4, PIXELS / 2);
        const float *unseen = scene_pixel(&turn.picture, PIXELS / 2 - PIXELS / 4, PIXELS / 2);
        const float *other = seen[3] > unseen[3] ? unseen : seen;
        assert_close(seen[3] + unseen[3], 1 - exp(-depth), 0.006);
        assert_true(other[3] == 0);
    }
    level_scene_destroy(&l);
}

/* ---- the same bits ---- */

static void assert_same(const scene_picture *a, const scene_picture *b)
{
    assert_memory_equal(a->rgba, b->rgba, 4 * sizeof(float) * (size_t)a->width * (size_t)a->height);
}

static void threads_and_tiles_draw_the_same(void **state)
{
    (void)state;
    level_scene l, tiles;
    level_scene_waves(&l, &level_waves);
    level_contents small = level_waves;
    small.tile = 16;
    level_scene_waves(&tiles, &small);
    for (int number = 0; number < 3; number++) {
        const trip_camera_params view = level_scene_view(&l, number, PIXELS);
        trip_settings settings = level_scene_settings();
        settings.shading = number == 1;
        scene_picture a = scene_draw(&l.at, &cpu_scenes_cpu, &view, &settings);
        scene_picture b = scene_draw(&tiles.at, &cpu_scenes_cpu, &view, &settings);
        cpu_scenes_threads = 1;
        scene_picture c = scene_draw(&l.at, &cpu_scenes_cpu, &view, &settings);
        cpu_scenes_threads = 3;
        assert_same(&a, &b);
        assert_same(&a, &c);
        scene_picture_free(&a);
        scene_picture_free(&b);
        scene_picture_free(&c);
    }
    level_scene_destroy(&l);
    level_scene_destroy(&tiles);
}

/* The level is so wide that its sheets do not fit the smaller memories, which draw it in windows.
 */
static void any_memory_draws_the_same_or_is_reported_as_too_little(void **state)
{
    (void)state;
    level_scene l;
    level_contents wide = level_waves;
    wide.dims[0] = 400;
    wide.dims[1] = 320;
    wide.dims[2] = 8;
    level_scene_create(&l, &wide);
    scene_colour(&l.of, 33000, 36000, 0.2, 0.5, 1, 0.1);
    scene_colour(&l.of, 57000, 65535, 1, 1, 0.6, 0.4);
    level_scene_use_colours(&l);
    const trip_camera_params view = scene_view(&l.at, trip_v3(0.6, 0.3, 1), 900, 50, PIXELS);
    const size_t bytes = 16 * (size_t)PIXELS * PIXELS;
    float *whole = malloc(bytes), *some = malloc(bytes);
    for (int kernel = TRIP_KERNEL_LINEAR; kernel <= TRIP_KERNEL_CUBIC; kernel++) {
        trip_settings settings = level_scene_settings();
        int drawn = 0, refused = 0;
        settings.kernel = (trip_kernel)kernel;
        assert_int_equal(
            cpu_scenes_draw_within(&l.at, UINT64_C(256) << 20, &settings, &view, whole), 0);
        for (uint64_t memory = 4 << 20; memory < 40 << 20; memory += 2000000) {
            memset(some, 0, bytes);
            const int status = cpu_scenes_draw_within(&l.at, memory, &settings, &view, some);
            if (status == 0)
                assert_memory_equal(some, whole, bytes);
            drawn += status == 0;
            refused += status != 0;
        }
        print_message("%d memories drew, %d were too little\n", drawn, refused);
        assert_true(drawn > 4 && refused > 0);
    }
    free(whole);
    free(some);
    level_scene_destroy(&l);
}

/* Every instruction set draws the same, within the rounding of single precision. */
static void instruction_sets_agree(void **state)
{
    (void)state;
    level_scene l;
    level_scene_waves(&l, &level_waves);
    const trip_camera_params view = level_scene_view(&l, 0, PIXELS);
    const trip_settings settings = level_scene_settings();
    setenv("TRIPTYCH_ISA", "plain", 1);
    scene_picture plain = scene_draw(&l.at, &cpu_scenes_cpu, &view, &settings);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        scene_picture p = scene_draw(&l.at, &cpu_scenes_cpu, &view, &settings);
        print_message("%s: %g\n", (*isa)->isa, scene_difference(&plain, &p));
        assert_true(scene_difference(&plain, &p) < 0.5 / 255);
        scene_picture_free(&p);
    }
    unsetenv("TRIPTYCH_ISA");
    scene_picture_free(&plain);
    level_scene_destroy(&l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_step_has_the_mean_extinction_of_the_distribution),
        cmocka_unit_test(colours_are_weighted_by_extinction),
        cmocka_unit_test(cpu_agrees_with_the_reference),
        cmocka_unit_test(codes_beyond_the_table_agree_with_the_reference),
        cmocka_unit_test(values_that_only_deviations_show_are_drawn),
        cmocka_unit_test(bricks_out_of_reach_are_transparent),
        cmocka_unit_test(threads_and_tiles_draw_the_same),
        cmocka_unit_test(any_memory_draws_the_same_or_is_reported_as_too_little),
        cmocka_unit_test(instruction_sets_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
