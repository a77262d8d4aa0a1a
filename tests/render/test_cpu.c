/* The CPU renderer against the reference, and against itself: whatever is only a matter of speed
 * must not change a bit. */
#include "cpu_isa.h"
#include "cpu_renderer.h"
#include "scenes.h"
#include "test.h"

#include <stdlib.h>
#include <string.h>

/* ---- scenes ---- */

/* Blobs and a shell with gaps, smooth and sharp, with normals. */
static bool blobs(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    double x = i - 19.5, y = j - 15.2, z = k - 17.1, r = sqrt(x * x + y * y + z * z);
    double value = 0.5 + 0.5 * sin(0.45 * i) * cos(0.38 * j + 0.2) * sin(0.41 * k);
    (void)user;
    gradient[0] = 0.05 * x / (r + 1);
    gradient[1] = 0.05 * y / (r + 1);
    gradient[2] = 0.05 * z / (r + 1);
    *code = (unsigned)(65535 * value);
    return value > 0.55 || (r > 12 && r < 13.5);
}

static void make_blobs(scene *s, unsigned tile_voxels, const trip_affine *index_to_world)
{
    scene_params p = { .dims = { 40, 33, 36 },
                       .tile_voxels = tile_voxels,
                       .slab_sheets = 8,
                       .normals = true,
                       .voxel = blobs };
    if (index_to_world)
        p.index_to_world = *index_to_world;
    scene_create(s, &p);
    scene_colour(s, 0, 36000, 0.2, 0.5, 1, 0.05);
    scene_colour(s, 36001, 50000, 0.9, 0.4, 0.1, 0.3);
    scene_colour(s, 50001, 65535, 1, 1, 0.6, 0.97);
}

static trip_affine sheared(void)
{
    return (trip_affine){ { { 0.8, 0.1, 0.05, 3 }, { -0.05, 1.1, 0.2, -7 }, { 0, 0.1, 1.9, 1 } } };
}

/* ---- renderers ---- */

static unsigned threads_asked = 3;

static int create_cpu(trip_renderer **out, trip_budget *budget)
{
    return trip_cpu_create(out, budget, threads_asked);
}

static const scene_renderer cpu = { "cpu", create_cpu, 1.0 / 255 };
static const scene_renderer reference = { "reference", trip_reference_create, 0 };

static double mean_difference(const scene_picture *a, const scene_picture *b)
{
    double sum = 0;
    size_t n = 4 * (size_t)a->width * (size_t)a->height;
    for (size_t i = 0; i < n; i++)
        sum += fabs((double)a->rgba[i] - (double)b->rgba[i]);
    return sum / (double)n;
}

static void compare(const scene *s, const trip_camera_params *view, const trip_settings *settings)
{
    scene_picture a = scene_draw(s, &reference, view, settings);
    scene_picture b = scene_draw(s, &cpu, view, settings);
    double most = scene_difference(&a, &b), mean = mean_difference(&a, &b);
    print_message("most %.5f mean %.6f (of 1/255)\n", 255 * most, 255 * mean);
    for (int axis = 0; axis < 3; axis++)
        assert_memory_equal(&a.stats.lists[axis], &b.stats.lists[axis], sizeof a.stats.lists[axis]);
    assert_true(most <= 1.0 / 255);
    assert_true(mean <= 0.05 / 255);
    scene_picture_free(&a);
    scene_picture_free(&b);
}

static void every_instruction_set_agrees_with_the_reference(void **state)
{
    (void)state;
    scene s;
    make_blobs(&s, 16, NULL);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        print_message("%s\n", (*isa)->isa);
        for (int i = 0; i < 6; i++) {
            double turn = 1.1 * i;
            trip_camera_params view = scene_view(
                &s, trip_v3(cos(turn), sin(turn), 0.5 * sin(3 * turn)), 60 - 8 * i, 50, 90);
            trip_settings settings = trip_settings_default();
            compare(&s, &view, &settings);
        }
    }
    unsetenv("TRIPTYCH_ISA");
    scene_destroy(&s);
    (void)sheared;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_instruction_set_agrees_with_the_reference),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
