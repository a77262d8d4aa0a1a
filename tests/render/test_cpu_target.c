/* Layers of smaller targets, with every instruction set. Checks the contents of a pixel, and the
 * resulting difference between the picture and the reference. */
#include "cpu/kernels/isa.h"
#include "cpu_scenes.h"
#include "splat.h"
#include "test.h"

#include <stdlib.h>
#include <string.h>

enum { SIZE = 64, DIM = 12 };

/* Colours alternate by diagonal, one third each. */
static bool striped(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 20000u * (unsigned)((i + j + k) % 3);
    return true;
}

static void make_stripes(scene *s)
{
    scene_create(
        s, &(scene_params){
               .dims = { DIM, DIM, DIM }, .tile_voxels = 16, .slab_sheets = 4, .voxel = striped });
    scene_colour(s, 0, 19999, 0.9, 0.3, 0.1, 0.004);
    scene_colour(s, 20000, 39999, 0.2, 0.8, 0.5, 0.15);
    scene_colour(s, 40000, 65535, 0.4, 0.5, 1, 0.7);
}

static trip_camera_params side_view(const scene *s)
{
    return scene_view(s, trip_v3(1, 0.4, 0.6), 26, 45, SIZE);
}

/* Without lists to merge and without background, the picture equals its layer. */
static trip_settings one_layer(trip_target target)
{
    trip_settings settings = trip_settings_default();
    settings.target = target;
    settings.method = TRIP_METHOD_AXIS;
    memset(settings.background, 0, sizeof settings.background);
    return settings;
}

/* Returns the nearest half float: eleven significant bits, or a multiple of 2^-24 below 2^-14. */
static double nearest_half(double a)
{
    int exponent;
    frexp(a, &exponent);
    double step = ldexp(1, (exponent < -13 ? -13 : exponent) - 11);
    return nearbyint(a / step) * step;
}

static void assert_only_halves(const scene_picture *p)
{
    for (int i = 0; i < 4 * SIZE * SIZE; i++)
        assert_true((double)p->rgba[i] == nearest_half((double)p->rgba[i]));
}

static void assert_only_steps_of_255(const scene_picture *p)
{
    for (int i = 0; i < 4 * SIZE * SIZE; i++) {
        double steps = 255 * (double)p->rgba[i];
        assert_true(fabs(steps - nearbyint(steps)) < 1e-4);
    }
}

static void check_content(trip_traversal traversal)
{
    scene s;
    make_stripes(&s);
    trip_camera_params view = side_view(&s);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        trip_settings half = one_layer(TRIP_TARGET_RGBA16F), byte = one_layer(TRIP_TARGET_RGBA8);
        half.traversal = byte.traversal = traversal;
        scene_picture halves = scene_draw(&s, &cpu_scenes_cpu, &view, &half);
        scene_picture bytes = scene_draw(&s, &cpu_scenes_cpu, &view, &byte);
        assert_only_halves(&halves);
        assert_only_steps_of_255(&bytes);
        scene_picture_free(&halves);
        scene_picture_free(&bytes);
    }
    unsetenv("TRIPTYCH_ISA");
    scene_destroy(&s);
}

static void layers_hold_values_of_their_target_front_to_back(void **state)
{
    (void)state;
    check_content(TRIP_TRAVERSAL_OUTWARD);
}

static void layers_hold_values_of_their_target_back_to_front(void **state)
{
    (void)state;
    check_content(TRIP_TRAVERSAL_ASCENDING);
}

/* Returns the number of splats with the pixel centre in their support. */
static unsigned occlusion_of(const trip_splat_frame *f, double x, double y)
{
    unsigned n = 0;
    for (int v = 0; v < DIM * DIM * DIM; v++) {
        trip_splat splat;
        trip_vec3 at = { v % DIM, v / DIM % DIM, v / (DIM * DIM) };
        n += trip_splat_project(f, at, &splat) && trip_splat_radius2(f, &splat, x, y) <= f->cutoff2;
    }
    return n;
}

/* A blend rounds a pixel by at most half a step. n blends add up to n half steps in colour. In
 * alpha they change the transmittance, which adds at most as much again: an error of the
 * transmittance is multiplied by the opacity of everything behind. Merging averages the layers.
 * Single precision and closing at TRIP_EARLY_TERMINATION_PRE add the rest. */
static void targets_are_off_by_at_most_a_step_a_splat(void **state)
{
    (void)state;
    scene s;
    make_stripes(&s);
    trip_camera_params view = side_view(&s);
    trip_settings settings = trip_settings_default();
    trip_camera camera;
    assert_int_equal(trip_camera_make(&camera, &view, &s.data->index_to_world), 0);
    trip_splat_frame f = trip_splat_frame_make(&camera, &settings);
    scene_picture expected = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        double steps[3] = { 0, 1.0 / 2048, 1.0 / 255 }, max[3] = { 0 };
        for (int target = TRIP_TARGET_RGBA16F; target <= TRIP_TARGET_RGBA8; target++) {
            settings.target = (trip_target)target;
            scene_picture p = scene_draw(&s, &cpu_scenes_cpu, &view, &settings);
            for (int i = 0; i < SIZE * SIZE; i++) {
                unsigned n = occlusion_of(&f, i % SIZE + 0.5, i / SIZE + 0.5);
                for (int c = 0; c < 4; c++) {
                    double off = fabs((double)p.rgba[4 * i + c] - (double)expected.rgba[4 * i + c]);
                    assert_true(off <= n * steps[target] + 0.5 / 255);
                    max[target] = fmax(max[target], off);
                }
            }
            scene_picture_free(&p);
        }
        print_message("%s: rgba16f off by %.3f, rgba8 by %.3f of 1/255\n", (*isa)->isa,
                      255 * max[TRIP_TARGET_RGBA16F], 255 * max[TRIP_TARGET_RGBA8]);
        assert_true(max[TRIP_TARGET_RGBA8] > max[TRIP_TARGET_RGBA16F]);
    }
    unsetenv("TRIPTYCH_ISA");
    scene_picture_free(&expected);
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layers_hold_values_of_their_target_front_to_back),
        cmocka_unit_test(layers_hold_values_of_their_target_back_to_front),
        cmocka_unit_test(targets_are_off_by_at_most_a_step_a_splat),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
