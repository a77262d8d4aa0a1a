/* Frames of the gl renderer in `post`. Compares them with the reference and checks that memory and
 * steps do not change a bit. Frames that exceed the memory are refused. The file test_sheets.c
 * tests all renderers, and test_gl_views.c draws real data. */
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "scenes.h"
#include "test.h"

static const scene_renderer reference = { "reference", trip_reference_create, 0 };
static const scene_renderer gl = { "gl", trip_gl_create, 1.0 / 255 };

/* Shells of changing value with a hole in them. They do not begin at the border of a square. */
static bool shells(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    double x = i - 20.5, y = j - 17.2, z = k - 19.1, r = sqrt(x * x + y * y + z * z);
    *code = (unsigned)(65535 * (0.5 + 0.5 * cos(0.7 * r)));
    return r < 15 && !(x > 2 && y > 3);
}

static const trip_affine sheared = {
    { { 0.8, 0.25, 0.05, 3 }, { -0.1, 1.1, 0.4, -7 }, { 0.1, 0.1, 1.4, 1 } }
};
/* Floats must not overflow or underflow. */
static const trip_affine huge = { { { 0, 0, 1e30, 0 }, { 0, 1e30, 0, 0 }, { -1e30, 0, 0, 0 } } };
/* A rotated grid of voxels a micrometre wide, in metres. */
static const trip_affine tiny = {
    { { 0.6e-6, -0.8e-6, 0, 0.01 }, { 0.8e-6, 0.6e-6, 0, -0.02 }, { 0, 0, 1e-6, 0.03 } }
};

static void make_shells(scene *s, const trip_affine *index_to_world, unsigned code_bytes)
{
    scene_create(s, &(scene_params){ .dims = { 41, 36, 38 },
                                     .index_to_world = *index_to_world,
                                     .tile_voxels = 16,
                                     .code_bytes = code_bytes,
                                     .voxel = shells });
    scene_colour(s, 0, 20000, 0.2, 0.5, 1, 0.02);
    scene_colour(s, 20001, 45000, 0.9, 0.4, 0.1, 0.2);
    scene_colour(s, 50001, 65535, 1, 1, 0.6, 0.8);
}

/* Uses codes that one byte can represent. */
static bool coarse_shells(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    bool there = shells(user, i, j, k, code, gradient);
    *code = TRIP_CODE_STEP * (TRIP_CODE_FIRST + *code / 257);
    return there;
}

static trip_settings post(void)
{
    trip_settings s = trip_settings_default();
    s.classify = TRIP_CLASSIFY_POST;
    return s;
}

/* Few pixels come near the bound. There, a rounding decides at early termination, at the border of
 * the grid or at a change of lists. */
static void assert_agrees(const char *label, const scene_picture *a, const scene_picture *b,
                          const trip_settings *settings)
{
    size_t count = 4 * (size_t)a->width * (size_t)a->height;
    double max = scene_difference(a, b), sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += fabs((double)a->rgba[i] - (double)b->rgba[i]);
    print_message("%-36s most %.4f mean %.5f of 1/255\n", label, 255 * max,
                  255 * sum / (double)count);
    assert_true(max <= scene_bound(settings));
    assert_true(sum / (double)count < 0.005 / 255);
}

static void compare(const char *label, const scene *s, const trip_camera_params *view,
                    const trip_settings *settings)
{
    scene_picture a = scene_draw(s, &reference, view, settings);
    scene_picture b = scene_draw(s, &gl, view, settings);
    assert_agrees(label, &a, &b, settings);
    scene_picture_free(&a);
    scene_picture_free(&b);
}

static void grids_of_any_shape_agree_with_the_reference(void **state)
{
    (void)state;
    const trip_affine maps[] = { trip_affine_identity(), sheared, tiny, huge };
    const char *const names[] = { "cubes", "sheared", "tiny", "huge" };
    for (int i = 0; i < 4; i++) {
        scene s;
        make_shells(&s, &maps[i], 2);
        const double unit = cbrt(fabs(trip_affine_determinant(&maps[i])));
        trip_camera_params view = scene_view(&s, trip_v3(1, 0.8, 0.5), 80 * unit, 30, 60);
        trip_settings settings = post();
        compare(names[i], &s, &view, &settings);
        settings.headlight = false;
        settings.light_direction = trip_normalize(trip_v3(-0.3, 0.5, 0.8));
        view = scene_view(&s, trip_v3(-0.2, 0.3, -1), 80 * unit, 30, 60);
        view.ortho_height = 35 * unit;
        compare(names[i], &s, &view, &settings);
        settings.point_light = true;
        settings.light_position = trip_affine_point(&maps[i], trip_v3(8, 31, 26.5));
        compare(names[i], &s, &view, &settings);
        view.ortho_height = 0;
        compare(names[i], &s, &view, &settings);
        scene_destroy(&s);
    }
}

static void codes_of_one_byte_agree_with_the_reference(void **state)
{
    (void)state;
    scene s;
    scene_create(
        &s, &(scene_params){ .dims = { 41, 36, 38 }, .code_bytes = 1, .voxel = coarse_shells });
    scene_colour(&s, 0, 65535, 0.9, 0.4, 0.1, 0.1);
    trip_camera_params view = scene_view(&s, trip_v3(0.3, -0.8, 0.5), 80, 30, 60);
    trip_settings settings = post();
    compare("one byte", &s, &view, &settings);
    scene_destroy(&s);
}

static void every_method_and_number_of_samples_per_sheet_agrees_with_the_reference(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &sheared, 2);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.9, 0.8), 40, 70, 60);
    for (int i = 0; i < 6; i++) {
        trip_settings settings = post();
        settings.method = (trip_method)(i % 3);
        settings.h = 0.3;
        settings.samples_per_sheet = i % 2 ? TRIP_SHEET_SAMPLES_MAX : 1 + i;
        settings.shading = i < 4;
        compare("methods", &s, &view, &settings);
    }
    scene_destroy(&s);
}

static void inside_and_far_views_agree_with_the_reference(void **state)
{
    (void)state;
    scene s;
    const trip_affine identity = trip_affine_identity();
    make_shells(&s, &identity, 2);
    trip_settings settings = post();
    trip_camera_params view = scene_view(&s, trip_v3(0.3, 0.2, 1), 4.3, 110, 60);
    compare("from within", &s, &view, &settings);
    settings.h = 0.1;
    view = scene_view(&s, trip_v3(1, -0.3, 0.4), 3, 160, 60);
    compare("from within, 160 degrees", &s, &view, &settings);
    view = scene_view(&s, trip_v3(1, 0.9, 0.4), 1e7, 2e-4, 60);
    compare("far away", &s, &view, &settings);
    view = scene_view(&s, trip_v3(1, 0.9, 0.4), 2, 30, 60);
    view.ortho_height = 30; /* about half of the grid lies behind the eye's plane */
    compare("parallel, within", &s, &view, &settings);
    scene_destroy(&s);
}

/* The test includes the grid's border, holes, and missing sheets. */
static void every_kernel_agrees_with_the_reference(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &sheared, 2);
    for (int i = 0; i < 4; i++) {
        trip_camera_params view = scene_view(&s, trip_v3(1, i % 2 ? 0.9 : -0.3, 0.8), 60, 40, 40);
        view.ortho_height = i == 3 ? 45 : 0;
        trip_settings settings = post();
        settings.kernel = i / 2 ? TRIP_KERNEL_GAUSSIAN : TRIP_KERNEL_CUBIC;
        settings.samples_per_sheet = 1 + i % 2;
        compare("kernels", &s, &view, &settings);
    }
    scene_destroy(&s);
}

/* Codes rise by ten per voxel along i. */
static bool gentle(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)j, (void)k, (void)gradient;
    *code = 1200 + 10u * (unsigned)i;
    return true;
}

/* Compared with the peak of another code, all visible extinction is a billionth. Its segments must
 * be differences of exact sums. On a ray, extinction is 0.05 over the first 99 codes and 0.1 from
 * the next code on. */
static void the_density_of_fog_does_not_depend_on_other_codes(void **state)
{
    (void)state;
    enum { EDGE = 20 };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = gentle });
    for (int code = 0; code < 2000; code++)
        s.table[code] = (trip_tf_entry){ 1, 0.5F, 0.25F, code < 1300 ? 0.05F : 0.1F };
    s.table[40000] = (trip_tf_entry){ 1, 1, 1, 1e9F };
    for (int i = 0; i < 6; i++) {
        trip_camera_params view = scene_view(&s, trip_v3(i % 2 ? 1 : -1, 0, 0), 60, 20, 4);
        view.ortho_height = 10;
        trip_settings settings = scene_post(1 + i / 2);
        scene_picture p = scene_draw(&s, &gl, &view, &settings);
        const double alpha = 1 - exp(-(99 * 0.05F + 0.5 * (0.05F + 0.1F) + 90 * 0.1F) / 10);
        for (int n = 0; n < 16; n++) {
            assert_close(p.rgba[4 * n], alpha, 1e-4);
            assert_close(p.rgba[4 * n + 1], alpha / 2, 1e-4);
            assert_close(p.rgba[4 * n + 3], alpha, 1e-4);
        }
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

static void depths_agree_with_the_reference(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &sheared, 2);
    for (int i = 0; i < 2; i++) {
        trip_camera_params view = scene_view(&s, trip_v3(1, 0.8, 0.5), 80, 30, 60);
        view.ortho_height = i ? 35 : 0;
        trip_settings settings = post();
        settings.depth = true;
        scene_picture a = scene_draw(&s, &reference, &view, &settings);
        scene_picture b = scene_draw(&s, &gl, &view, &settings);
        int seen = 0;
        for (int n = 0; n < 60 * 60; n++) {
            assert_true(isinf(a.depth[n]) == isinf(b.depth[n]));
            if (isinf(a.depth[n]) || a.rgba[4 * n + 3] < 0.01F)
                continue;
            assert_close(a.depth[n] - b.depth[n], 0, 0.002);
            seen++;
        }
        assert_true(seen > 500);
        assert_agrees("with depths", &a, &b, &settings);
        scene_picture_free(&a);
        scene_picture_free(&b);
    }
    scene_destroy(&s);
}

/* A layer of more than 2^24 pixels consists of bands: here 2048 rows, and 12. */
static void layers_of_two_bands_are_whole(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 5, 40, 40 } });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 1, 1, 1, 0.2F };
    trip_settings settings = post();
    settings.shading = false;
    settings.samples_per_sheet = 1;
    settings.background[3] = 0;
    trip_camera_params view = scene_view(&s, trip_v3(1, 0, 0), 40, 40, 64);
    view.width = 8192;
    view.height = 2060;
    view.ortho_height = 5;
    scene_picture p = scene_draw(&s, &gl, &view, &settings);
    for (int y = 0; y < p.height; y++)
        for (int x = y % 16; x < p.width; x += 16) {
            double alpha = fabs(x + 0.5 - 4096) * 5 / 2060 < 19.5 ? 1 - exp(-0.2F * 4) : 0;
            if (fabs(fabs(x + 0.5 - 4096) * 5 / 2060 - 19.5) > 0.01)
                assert_close(scene_pixel(&p, x, y)[3], alpha, 1e-5);
        }
    scene_picture_free(&p);
    scene_destroy(&s);
}

enum { SIZE = 48 };

typedef struct bench {
    scene *scene;
    trip_renderer *renderer;
    trip_reader *reader;
    trip_camera camera;
    trip_settings settings;
    trip_plan plan;
    trip_frame frame;
} bench;

static void set_up(bench *b, scene *s, trip_vec3 direction, double fov, trip_method method)
{
    *b = (bench){ .scene = s, .settings = post() };
    b->settings.method = method;
    b->settings.background[3] = 0;
    trip_camera_params view = scene_view(s, direction, 80, fov, SIZE);
    assert_int_equal(trip_gl_create(&b->renderer, s->budget), 0);
    assert_int_equal(trip_camera_make(&b->camera, &view, &s->data->index_to_world), 0);
    assert_int_equal(
        trip_plan_make(&b->plan, s->data, &b->camera, &b->settings, s->table, s->budget), 0);
    trip_reader_params params = { .planes = b->plan.planes, .engine = TRIP_ENGINE_NULL };
    assert_int_equal(trip_reader_create(&b->reader, s->data, &params, s->budget), 0);
    b->frame = (trip_frame){ .data = s->data,
                             .camera = &b->camera,
                             .settings = &b->settings,
                             .plan = &b->plan,
                             .table = s->table };
}

static void put_away(bench *b)
{
    trip_reader_destroy(b->reader);
    trip_plan_release(&b->plan, b->scene->budget);
    b->renderer->ops->destroy(b->renderer);
}

/* Draws a frame in the shortest possible steps, at most `max`. Returns their number. Cancels a
 * frame that has not ended by then. */
static int draw_in_steps(bench *b, int max, float *rgba)
{
    trip_drawing drawing;
    int status = TRIP_FRAME_MORE, steps = 0;
    assert_int_equal(trip_frame_begin(&drawing, b->renderer, b->reader, &b->frame), 0);
    while (status > 0 && steps < max) {
        status = trip_frame_step(&drawing, 0);
        steps += status == TRIP_FRAME_MORE;
        if (status == TRIP_FRAME_WAITS)
            trip_frame_await(&drawing, UINT64_MAX);
    }
    assert_true(status >= 0);
    if (status == TRIP_FRAME_DONE)
        assert_int_equal(trip_frame_picture(&drawing, rgba, NULL), 0);
    trip_frame_end(&drawing);
    return steps;
}

static void frames_cancelled_anywhere_leave_the_next_unchanged(void **state)
{
    (void)state;
    static float rgba[4 * SIZE * SIZE];
    scene s;
    bench b;
    make_shells(&s, &sheared, 2);
    set_up(&b, &s, trip_v3(1, 0.8, 0.7), 30, TRIP_METHOD_MERGE);
    scene_picture whole = scene_draw(&s, &gl, &b.camera.params, &b.settings);
    int all = draw_in_steps(&b, INT_MAX, rgba);
    assert_memory_equal(rgba, whole.rgba, sizeof rgba);
    assert_true(all > 40); /* in parts, not at once */
    for (int max = 1; max < all; max += all / 8) {
        assert_int_equal(draw_in_steps(&b, max, rgba), max);
        memset(rgba, 0, sizeof rgba);
        assert_int_equal(draw_in_steps(&b, INT_MAX, rgba), all);
        assert_memory_equal(rgba, whole.rgba, sizeof rgba);
    }
    scene_picture_free(&whole);
    put_away(&b);
    scene_destroy(&s);
}

static char last_line[512];

static void keep_line(const char *line, void *user)
{
    (void)user;
    snprintf(last_line, sizeof last_line, "%s", line);
}

/* Draws a frame with `left` bytes of the budget free, and returns its status. */
static int draw_with(bench *b, uint64_t left, float *rgba)
{
    trip_frame_stats stats;
    size_t max = (size_t)(trip_budget_left_bytes(b->scene->budget) - left);
    void *taken = trip_budget_take(b->scene->budget, max);
    assert_non_null(taken);
    last_line[0] = 0;
    trip_report_redirect(keep_line, NULL);
    int status = trip_frame_draw(b->renderer, b->reader, &b->frame, rgba, NULL, &stats);
    trip_report_redirect(NULL, NULL);
    trip_budget_release(b->scene->budget, taken, max);
    return status;
}

static bool waves(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = (unsigned)(32768 + 30000 * sin(0.9 * i + 0.1 * j) * cos(0.13 * k));
    return true;
}

/* A sheet takes 12 bytes a voxel, almost 2 MiB. The renderer holds eight sheets at a time, or
 * three if memory is short. */
static void memory_changes_no_bit_and_too_little_is_refused(void **state)
{
    (void)state;
    static float rgba[2][4 * SIZE * SIZE];
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 14, 400, 400 }, .voxel = waves });
    scene_colour(&s, 30000, 40000, 0.2, 0.5, 1, 0.02);
    scene_colour(&s, 40001, 65535, 0.9, 0.4, 0.1, 0.2);
    for (int i = 0; i < 2; i++) {
        bench b;
        set_up(&b, &s, trip_v3(1, 0.1, 0.1), 140, TRIP_METHOD_AXIS);
        assert_int_equal(draw_with(&b, (i ? UINT64_C(12) : 64) << 20, rgba[i]), 0);
        put_away(&b);
    }
    assert_memory_equal(rgba[0], rgba[1], sizeof rgba[0]);
    assert_true(rgba[0][4 * (SIZE / 2 * SIZE + SIZE / 2) + 3] > 0.1F);

    bench b;
    set_up(&b, &s, trip_v3(1, 0.1, 0.1), 140, TRIP_METHOD_AXIS);
    assert_true(draw_with(&b, UINT64_C(7) << 20, rgba[1]) < 0);
    assert_non_null(
        strstr(last_line, "3 sheets of 400 x 400 voxels do not fit the memory given; raise"));
    assert_int_equal(draw_with(&b, UINT64_C(64) << 20, rgba[1]), 0);
    assert_memory_equal(rgba[0], rgba[1], sizeof rgba[0]);
    put_away(&b);
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(grids_of_any_shape_agree_with_the_reference),
        cmocka_unit_test(codes_of_one_byte_agree_with_the_reference),
        cmocka_unit_test(every_method_and_number_of_samples_per_sheet_agrees_with_the_reference),
        cmocka_unit_test(inside_and_far_views_agree_with_the_reference),
        cmocka_unit_test(every_kernel_agrees_with_the_reference),
        cmocka_unit_test(the_density_of_fog_does_not_depend_on_other_codes),
        cmocka_unit_test(depths_agree_with_the_reference),
        cmocka_unit_test(layers_of_two_bands_are_whole),
        cmocka_unit_test(frames_cancelled_anywhere_leave_the_next_unchanged),
        cmocka_unit_test(memory_changes_no_bit_and_too_little_is_refused),
    };
    if (!scene_has_gl())
        return 77;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
