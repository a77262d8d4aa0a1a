/* Codes of one byte and normals of three bytes, drawn by every renderer. */
#include "scenes.h"

#include "test.h"

#include <string.h>

enum { N = 30, SIZE_PX = 56 };

static const trip_affine grid = { { { 0, -0.5, 0.1, 3 }, { 0.7, 0, 0, -2 }, { 0, 0.1, 0.6, 5 } } };

/* A ball with gradients that point outwards or inwards. Their lengths go from zero to twice the
 * gradient of full shading. */
static bool ball(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    trip_vec3 d =
        trip_affine_vector(&grid, trip_v3(i - 0.5 * (N - 1), j - 0.5 * (N - 1), k - 0.5 * (N - 1)));
    uint32_t hash = scene_hash(i, j, k);
    double length = hash % 1000 / 500.0 * 0.04 / 0.6;
    trip_vec3 g = trip_scale(trip_normalize(d), hash & 1024 ? length : -length);
    gradient[0] = g.x;
    gradient[1] = g.y;
    gradient[2] = g.z;
    *code = TRIP_CODE_STEP * (TRIP_CODE_FIRST + 128 + hash % 100);
    return trip_length(d) < 7 && trip_length(d) > 5;
}

static void make(scene *s, unsigned code_bytes, unsigned normal_bytes)
{
    scene_create(s, &(scene_params){ .dims = { N, N, N },
                                     .index_to_world = grid,
                                     .tile_voxels = 32,
                                     .slab_sheets = 8,
                                     .normals = true,
                                     .code_bytes = code_bytes,
                                     .normal_bytes = normal_bytes,
                                     .voxel = ball });
    const int middle = TRIP_CODE_STEP * (TRIP_CODE_FIRST + 180);
    scene_colour(s, 0, middle, 1, 0.6, 0.2, 0.3);
    scene_colour(s, middle + 1, 65535, 0.2, 0.5, 0.9, 0.3);
}

static trip_settings lit(bool headlight)
{
    trip_settings settings = trip_settings_default();
    settings.headlight = headlight;
    settings.light_direction = trip_normalize(trip_v3(1, -2, 0.5));
    return settings;
}

static void compare(const scene *a, const scene *b, const scene_renderer *r, double max)
{
    for (int i = 0; i < 4; i++) {
        trip_settings settings = lit(i % 2);
        trip_camera_params view =
            scene_view(a, trip_v3(1 - i, 0.4, i % 2 ? 0.3 : -0.8), 30, 34, SIZE_PX);
        view.ortho_height = i == 3 ? 16 : 0;
        scene_picture expected = scene_draw(a, &scene_renderers()[0], &view, &settings);
        scene_picture p = scene_draw(b, r, &view, &settings);
        double off = scene_difference(&expected, &p);
        if (!(off <= max))
            fail_msg("%s: off by %g", r->name, off);
        scene_picture_free(&expected);
        scene_picture_free(&p);
    }
}

static void every_renderer_shades_three_byte_normals_like_the_reference(void **state)
{
    (void)state;
    scene s;
    make(&s, 2, 3);
    for (const scene_renderer *r = scene_renderers() + 1; r->name; r++)
        compare(&s, &s, r, r->tolerance);
    scene_destroy(&s);
}

/* Normals of four bytes have the coarser scale here. */
static void normals_of_three_bytes_shade_like_normals_of_four(void **state)
{
    (void)state;
    scene four, three;
    make(&four, 2, 4);
    make(&three, 2, 3);
    for (const scene_renderer *r = scene_renderers(); r->name; r++)
        compare(&four, &three, r, 4.0 / 255);
    scene_destroy(&four);
    scene_destroy(&three);
}

static void codes_of_one_byte_draw_the_same_bits(void **state)
{
    (void)state;
    scene one, two;
    trip_settings settings = lit(true);
    make(&one, 1, 4);
    make(&two, 2, 4);
    trip_camera_params view = scene_view(&one, trip_v3(0.3, 0.4, 1), 30, 34, SIZE_PX);
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        scene_picture p = scene_draw(&one, r, &view, &settings);
        scene_picture q = scene_draw(&two, r, &view, &settings);
        assert_memory_equal(p.rgba, q.rgba, sizeof(float) * 4 * SIZE_PX * SIZE_PX);
        scene_picture_free(&p);
        scene_picture_free(&q);
    }
    scene_destroy(&one);
    scene_destroy(&two);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_renderer_shades_three_byte_normals_like_the_reference),
        cmocka_unit_test(normals_of_three_bytes_shade_like_normals_of_four),
        cmocka_unit_test(codes_of_one_byte_draw_the_same_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
