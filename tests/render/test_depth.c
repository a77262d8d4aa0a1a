/* Depth pictures. Compares the distances of flat objects with closed forms, and the renderers with
 * the reference. */
#include "cpu/kernels/isa.h"
#include "cpu_scenes.h"
#include "test.h"

#include <string.h>

/* Sheets of the slabs. The slabs fill the grid across the view. */
enum { N = 24, FRONT = 14, BACK = 5 };

static bool one_slab(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)i;
    (void)j;
    (void)gradient;
    *code = 1;
    return k <= FRONT;
}

static bool two_sheets(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)i;
    (void)j;
    (void)gradient;
    *code = 1;
    return k == FRONT || k == BACK;
}

static bool one_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 1;
    return i == N / 2 && j == N / 2 && k == N / 2;
}

/* Turned about x and stretched along the last axis, in units of 1000. */
static const trip_affine turned = {
    { { 1000, 0, 0, 500 }, { 0, 600, -1600, 100 }, { 0, 800, 1200, -300 } }
};
static const trip_affine plain = { { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } } };

static trip_settings with_depth(void)
{
    trip_settings s = trip_settings_default();
    s.shading = false;
    s.depth = true;
    return s;
}

/* Returns a view along the last axis, from the side of the last sheets. The eye is `distance`
 * voxel thicknesses from sheet FRONT. */
static trip_camera_params head_on(const scene *s, double distance, bool parallel)
{
    const trip_affine *map = &s->data->index_to_world;
    double middle = 0.5 * (N - 1);
    trip_camera_params view = { .fov_degrees = 12, .width = 21, .height = 21 };
    view.look = trip_affine_point(map, trip_v3(middle, middle, FRONT));
    view.eye = trip_affine_point(map, trip_v3(middle, middle, FRONT + distance));
    view.up = trip_affine_vector(map, trip_v3(0, 1, 0));
    if (parallel)
        view.ortho_height = 0.4 * distance * trip_length(view.up);
    return view;
}

/* Returns 1 / cos of the angle between a pixel's ray and the central ray. */
static double slant(const trip_camera_params *view, int x, int y)
{
    double per_pixel = 2 * tan(view->fov_degrees / 360 * 3.14159265358979323846) / view->height;
    double across = (x + 0.5 - 0.5 * view->width) * per_pixel;
    double down = (y + 0.5 - 0.5 * view->height) * per_pixel;
    return view->ortho_height > 0 ? 1 : sqrt(1 + across * across + down * down);
}

/* The mean visible distance must be `sheets` sheets beyond FRONT, within `tolerance` sheets. */
static void expect_mean(const scene *s, const trip_camera_params *view, double distance,
                        double sheets, double tolerance)
{
    trip_settings settings = with_depth();
    double thickness = trip_length(trip_affine_vector(&s->data->index_to_world, trip_v3(0, 0, 1)));
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        scene_picture p = scene_draw(s, r, view, &settings);
        for (int i = 0; i < p.width * p.height; i++) {
            double along = (double)p.depth[i] / slant(view, i % p.width, i / p.width) / thickness;
            if (!(fabs(along - distance - sheets) <= tolerance))
                fail_msg("%s: pixel %d lies %g sheets off, expected %g", r->name, i,
                         along - distance, sheets);
        }
        scene_picture_free(&p);
    }
}

static void check_flat(scene_voxel voxel, double opacity, double sheets, double tolerance)
{
    const trip_affine maps[] = { plain, turned };
    for (int i = 0; i < 4; i++) {
        scene s;
        scene_create(&s, &(scene_params){ .dims = { N, N, N },
                                          .index_to_world = maps[i / 2],
                                          .tile_voxels = 16,
                                          .voxel = voxel });
        /* The unit is one voxel thickness, not the cube root of the voxel's volume. */
        double thickness =
            trip_length(trip_affine_vector(&s.data->index_to_world, trip_v3(0, 0, 1)));
        double voxel_world = cbrt(fabs(trip_affine_determinant(&s.data->index_to_world)));
        scene_colour(&s, 1, 1, 1, 0.5, 0.2, 1 - pow(1 - opacity, voxel_world / thickness));
        trip_camera_params view = head_on(&s, 30, i % 2);
        expect_mean(&s, &view, 30, sheets, tolerance);
        scene_destroy(&s);
    }
}

/* A sheet lets 1e-4 of the light pass. This share is visible one sheet farther back. */
static void an_opaque_slab_is_as_far_as_its_front_face(void **state)
{
    (void)state;
    check_flat(one_slab, 0.9999, 0, 2e-3);
}

/* Splats and their sums must stay finite, however opaque the slab is. */
static void a_slab_keeps_its_distance_and_brightness_at_any_opacity(void **state)
{
    (void)state;
    const float rgb[3] = { 1, 0.5F, 0.2F };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { N, N, N }, .tile_voxels = 16, .voxel = one_slab });
    for (int i = 0; i < 6; i++) {
        const double extinctions[3] = { 1e12, 1e27, 3e38 };
        for (int code = 0; code < 65536; code++)
            s.table[code] = (trip_tf_entry){ rgb[0], rgb[1], rgb[2], (float)extinctions[i / 2] };
        trip_settings settings = with_depth();
        settings.compositing = (trip_compositing)(i % 2);
        trip_camera_params view = head_on(&s, 30, false);
        scene_turn turn = scene_turns(scene_renderers(), &s, &view, &settings);
        while (scene_take_turn(&turn))
            for (int n = 0; n < view.width * view.height; n++) {
                const float *c = turn.picture.rgba + 4 * n;
                const double far = 30 * slant(&view, n % view.width, n / view.width);
                for (int k = 0; k < 4; k++)
                    assert_close(c[k], k < 3 ? rgb[k] : 1, 1e-5);
                assert_close(turn.picture.depth[n], far, 1e-5);
            }
    }
    scene_destroy(&s);
}

/* The centre of the only splat lies half a voxel behind the eye, or behind the eye's plane in
 * parallel views. The visible rest of the splat has no distance. */
static void splats_centred_behind_the_eye_have_no_distance(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { N, N, N }, .voxel = one_voxel });
    scene_colour(&s, 1, 1, 1, 1, 1, 0.5);
    for (int i = 0; i < 4; i++) {
        trip_settings settings = with_depth();
        settings.compositing = (trip_compositing)(i % 2);
        trip_camera_params view = { .eye = { N / 2 + 0.1, N / 2, N / 2 - 0.5 },
                                    .look = { N / 2 + 0.1, N / 2, 0 },
                                    .up = { 0, 1, 0 },
                                    .fov_degrees = 60,
                                    .ortho_height = i / 2 ? 3 : 0,
                                    .width = 12,
                                    .height = 12 };
        scene_turn turn = scene_turns(scene_renderers(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            int seen = 0;
            for (int n = 0; n < view.width * view.height; n++) {
                const bool shows = turn.picture.rgba[4 * n] > 1e-3F;
                seen += shows;
                if (shows && !(turn.picture.depth[n] == 0))
                    fail_msg("%s: pixel %d lies %g away", turn.renderer->name, n,
                             (double)turn.picture.depth[n]);
            }
            assert_true(seen > 20);
        }
    }
    scene_destroy(&s);
}

/* The front sheet has the share 0.5 and the back sheet 0.25. Kernels have a ripple of about a
 * hundredth. */
static void two_half_transparent_sheets_are_at_their_weighted_mean(void **state)
{
    (void)state;
    check_flat(two_sheets, 0.5, (FRONT - BACK) * 0.25 / 0.75, 0.06);
}

static void empty_pixels_are_infinitely_far(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { N, N, N }, .voxel = one_voxel });
    scene_colour(&s, 1, 1, 1, 1, 1, 0.5);
    trip_settings settings = with_depth();
    trip_camera_params view = scene_view(&s, trip_v3(0.8, 0.9, 1), 40, 40, 96);
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        scene_picture p = scene_draw(&s, r, &view, &settings);
        int seen = 0;
        for (int i = 0; i < p.width * p.height; i++) {
            assert_int_equal(isinf(p.depth[i]) != 0, p.rgba[4 * i] == 0);
            assert_true(p.depth[i] > 38);
            seen += !isinf(p.depth[i]);
        }
        assert_true(seen > 20 && seen < 1000);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

/* Returns the difference of the distances times their opacity, in units of the object's size. */
static double depth_difference(const scene_picture *a, const scene_picture *b, double size)
{
    double max = 0;
    for (int i = 0; i < a->width * a->height; i++) {
        double alpha = (double)a->rgba[4 * i + 3];
        if (alpha > 1e-3)
            max = fmax(max, alpha * fabs((double)a->depth[i] - (double)b->depth[i]) / size);
    }
    return max;
}

/* Distances may differ by 1/255 of the object's size. Colours must equal the picture without
 * distances within `colours`. */
static void compare_one(const scene *s, const scene_renderer *renderer, const char *name,
                        const trip_camera_params *view, const trip_settings *settings,
                        const scene_picture *expected, double colours)
{
    trip_settings colour = *settings;
    colour.depth = false;
    scene_picture p = scene_draw(s, renderer, view, settings);
    scene_picture q = scene_draw(s, renderer, view, &colour);
    double off = depth_difference(expected, &p, 40);
    if (!(off <= 1.0 / 255))
        fail_msg("%s: off by %g", name, off);
    assert_true(scene_difference(&p, &q) <= colours);
    scene_picture_free(&p);
    scene_picture_free(&q);
}

static void compare(const scene *s, const trip_camera_params *view, const trip_settings *settings)
{
    scene_picture expected = scene_draw(s, &cpu_scenes_reference, view, settings);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        compare_one(s, &cpu_scenes_cpu, (*isa)->isa, view, settings, &expected, 0);
    }
    unsetenv("TRIPTYCH_ISA");
    for (const scene_renderer *r = scene_renderers(); r->name; r++)
        if (!strcmp(r->name, "gl"))
            compare_one(s, r, r->name, view, settings, &expected, 1e-6);
    scene_picture_free(&expected);
}

/* Threads, batches and splat buffers must not change a bit. */
static void expect_same_bits(const scene *s, const trip_camera_params *view,
                             const trip_settings *settings)
{
    const trip_reader_params small = { .slots = 2, .slot_bytes = 8192 };
    scene_picture p = scene_draw(s, &cpu_scenes_cpu, view, settings);
    cpu_scenes_threads = 1;
    scene_picture q = scene_draw_with(s, &cpu_scenes_cpu, view, settings, &small);
    cpu_scenes_threads = 3;
    assert_memory_equal(p.depth, q.depth, (size_t)p.width * (size_t)p.height * sizeof *p.depth);
    scene_picture_free(&p);
    scene_picture_free(&q);
}

static void check_blobs(const trip_affine *map, const trip_settings *settings)
{
    scene s;
    cpu_scenes_blobs(&s, 16, map);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.9, -0.8), 70, 45, 70);
    compare(&s, &view, settings);
    view.ortho_height = 50;
    compare(&s, &view, settings);
    view = scene_view(&s, trip_v3(0.3, 1, 0.2), 6, 110, 70);
    compare(&s, &view, settings);
    expect_same_bits(&s, &view, settings);
    scene_destroy(&s);
}

static void renderers_have_the_depths_of_the_reference_and_unchanged_colours(void **state)
{
    (void)state;
    trip_settings settings = with_depth();
    settings.background[3] = 0; /* so that alpha is the object's alone */
    trip_affine sheared = cpu_scenes_sheared();
    settings.h = 0.3;
    check_blobs(NULL, &settings);
    check_blobs(&sheared, &settings);
    settings.method = TRIP_METHOD_CLIP;
    check_blobs(&sheared, &settings);
    settings.traversal = TRIP_TRAVERSAL_ASCENDING;
    settings.method = TRIP_METHOD_AXIS;
    check_blobs(NULL, &settings);
}

/* The sheets are so faint that the transmittance rounds their opacity away. No distance may lie
 * before or behind the volume. */
static void faint_sheets_have_the_right_distance(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { N, N, N }, .voxel = one_slab });
    scene_colour(&s, 1, 1, 1, 1, 1, 3e-8);
    trip_settings settings = with_depth();
    settings.compositing = TRIP_COMPOSITING_SHEET;
    trip_camera_params view = scene_view(&s, trip_v3(0.8, 0.9, 1), 60, 40, 48);
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        scene_picture p = scene_draw(&s, r, &view, &settings);
        for (int i = 0; i < p.width * p.height; i++)
            if (!isinf(p.depth[i]) && !(p.depth[i] > 30 && p.depth[i] < 90))
                fail_msg("%s: pixel %d lies %g away", r->name, i, (double)p.depth[i]);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

static void depths_refuse_rounded_targets(void **state)
{
    (void)state;
    trip_settings settings = with_depth();
    assert_int_equal(trip_settings_check(&settings), 0);
    settings.target = TRIP_TARGET_RGBA8;
    test_catch_reports();
    assert_int_equal(trip_settings_check(&settings), TRIP_USAGE);
    assert_one_report("rounded layers have no depth; leave the target at rgba32f");
    settings.depth = false;
    assert_int_equal(trip_settings_check(&settings), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_opaque_slab_is_as_far_as_its_front_face),
        cmocka_unit_test(a_slab_keeps_its_distance_and_brightness_at_any_opacity),
        cmocka_unit_test(splats_centred_behind_the_eye_have_no_distance),
        cmocka_unit_test(two_half_transparent_sheets_are_at_their_weighted_mean),
        cmocka_unit_test(empty_pixels_are_infinitely_far),
        cmocka_unit_test(renderers_have_the_depths_of_the_reference_and_unchanged_colours),
        cmocka_unit_test(faint_sheets_have_the_right_distance),
        cmocka_unit_test(depths_refuse_rounded_targets),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
