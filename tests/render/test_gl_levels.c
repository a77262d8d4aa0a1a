/* Frames of coarse levels with deviations, drawn by gl. Compares them with the reference and checks
 * that memory and steps do not change a bit. test_blurred_levels.c compares gl with closed forms,
 * and test_gl_views.c draws real data. */
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "level_scenes.h"
#include "report.h"
#include "test.h"

enum { PIXELS = TEST_BY_TURNS ? 32 : 48 };

static const scene_renderer reference = { "reference", trip_reference_create, 0 };
static const scene_renderer gl = { "gl", trip_gl_create, 1.0 / 255 };

/* Two pictures agree if few pixels come near the bound. */
static void compare(const char *label, const level_scene *l, const trip_camera_params *view,
                    const trip_settings *settings)
{
    scene_picture a = scene_draw(&l->at, &reference, view, settings);
    scene_picture b = scene_draw(&l->at, &gl, view, settings);
    const size_t count = 4 * (size_t)a.width * (size_t)a.height;
    const double max = scene_difference(&a, &b);
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += fabs((double)a.rgba[i] - (double)b.rgba[i]);
    print_message("%-36s most %.4f mean %.5f of 1/255\n", label, 255 * max,
                  255 * sum / (double)count);
    assert_true(scene_max_opaque(&a) > 0.03);
    assert_true(max <= scene_bound(settings));
    assert_true(sum / (double)count < 0.005 / 255);
    scene_picture_free(&a);
    scene_picture_free(&b);
}

typedef struct variation {
    const char *name;
    bool shading, depth;
    double cueing;
    int samples_per_sheet; /* 0 selects 2 */
    trip_kernel kernel;
    bool clipped;
    trip_method method;
} variation;

static const variation variations[] = {
    { "plain", .shading = false },
    { "lit", .shading = true },
    { "depths", .depth = true },
    { "cueing, lit", .shading = true, .cueing = 0.5 },
    { "three samples, clipped", .samples_per_sheet = 3, .clipped = true },
    { "cubic, clipped", .kernel = TRIP_KERNEL_CUBIC, .clipped = true },
    { "cubic, lit", .shading = true, .kernel = TRIP_KERNEL_CUBIC },
    { "Gaussian", .kernel = TRIP_KERNEL_GAUSSIAN, .clipped = true },
    { "one axis", .method = TRIP_METHOD_AXIS },
};

static trip_settings settings_of(const variation *v)
{
    trip_settings s = level_scene_settings();
    s.shading = v->shading;
    s.depth = v->depth;
    s.effects.cueing = v->cueing;
    s.samples_per_sheet = v->samples_per_sheet ? v->samples_per_sheet : 2;
    s.kernel = v->kernel;
    s.method = v->method;
    if (v->clipped)
        trip_clip_add(&s.clip, trip_v3(1, 0.3, 0.2), -40);
    return s;
}

static void every_kind_of_frame_agrees_with_the_reference(void **state)
{
    (void)state;
    level_scene l;
    level_scene_waves(&l, &level_waves);
    for (int number = 0; number < 3; number++) {
        const trip_camera_params view = level_scene_view(&l, number, PIXELS);
        for (size_t i = 0; i < sizeof variations / sizeof *variations; i++) {
            const trip_settings settings = settings_of(&variations[i]);
            compare(variations[i].name, &l, &view, &settings);
        }
    }
    level_scene_destroy(&l);
}

/* Light and shadows are computed from the values alone. */
static void shadows_agree_with_the_reference(void **state)
{
    (void)state;
    level_scene l;
    level_scene_waves(&l, &level_waves);
    const trip_camera_params view = level_scene_view(&l, 0, PIXELS);
    trip_settings settings = scene_with_shadows(trip_normalize(trip_v3(0.3, 0.5, 0.8)));
    settings.lod_px = 1;
    compare("shadows", &l, &view, &settings);
    level_scene_destroy(&l);
}

/* Opaque colours that change within a few codes. */
static void narrow_opaque_bands_agree_with_the_reference(void **state)
{
    (void)state;
    level_scene l;
    level_scene_create(&l, &level_waves);
    for (unsigned code = 14000; code < 60000; code += 3000)
        scene_colour(&l.of, code, code + 40, code % 9000 ? 1 : 0.2, code % 6000 ? 0.1 : 1, 0.5,
                     code % 9000 ? 0.9999 : 0.01);
    level_scene_use_colours(&l);
    const trip_settings settings = level_scene_settings();
    for (int number = 0; number < 3; number++) {
        const trip_camera_params view = level_scene_view(&l, number, PIXELS);
        compare("narrow bands", &l, &view, &settings);
    }
    level_scene_destroy(&l);
}

static void values_that_only_deviations_show_are_drawn(void **state)
{
    (void)state;
    level_scene l;
    level_scene_create(&l, &level_waves);
    scene_colour(&l.of, 100, 4000, 1, 0.5, 0.25, 0.4); /* below all values */
    level_scene_use_colours(&l);
    for (int number = 0; number < 3; number++) {
        const trip_camera_params view = level_scene_view(&l, number, PIXELS);
        trip_settings settings = level_scene_settings();
        compare("only deviations", &l, &view, &settings);
        settings.deviations = false;
        scene_picture none = scene_draw(&l.at, &gl, &view, &settings);
        assert_true(scene_max_opaque(&none) == 0);
        scene_picture_free(&none);
    }
    level_scene_destroy(&l);
}

static void codes_beyond_the_table_agree_with_the_reference(void **state)
{
    (void)state;
    level_scene l;
    level_scene_blocks(&l);
    trip_settings settings = level_scene_settings();
    settings.kernel = TRIP_KERNEL_CUBIC;
    for (int number = 0; number < 3; number++) {
        const trip_camera_params view = level_scene_view(&l, number, PIXELS);
        settings.deviations = true;
        compare("beyond the table", &l, &view, &settings);
        settings.deviations = false;
        compare("beyond the table, not blurred", &l, &view, &settings);
    }
    level_scene_destroy(&l);
}

static void grids_of_any_shape_agree_with_the_reference(void **state)
{
    (void)state;
    const trip_affine maps[] = {
        { { { 0.8, 0.25, 0.05, 3 }, { -0.1, 1.1, 0.4, -7 }, { 0.1, 0.1, 1.4, 1 } } },
        { { { 0, 0, 1e30, 0 }, { 0, 1e30, 0, 0 }, { -1e30, 0, 0, 0 } } },
        { { { 0.6e-6, -0.8e-6, 0, 0.01 }, { 0.8e-6, 0.6e-6, 0, -0.02 }, { 0, 0, 1e-6, 0.03 } } },
    };
    const char *const names[] = { "sheared", "huge", "tiny" };
    for (int i = 0; i < 3; i++) {
        level_scene l;
        level_contents c = level_waves;
        c.index_to_world = &maps[i];
        level_scene_waves(&l, &c);
        const double unit = cbrt(fabs(trip_affine_determinant(&maps[i])));
        trip_camera_params view = scene_view(&l.at, trip_v3(1, 0.8, 0.5), 190 * unit, 40, PIXELS);
        trip_settings settings = level_scene_settings();
        settings.shading = true;
        compare(names[i], &l, &view, &settings);
        level_scene_destroy(&l);
    }
}

/* Stored codes stand for values that grow exponentially. Draw codes are linear in the value, so
 * deviations grow with the values. */
static void uneven_codes_agree_with_the_reference(void **state)
{
    (void)state;
    enum { KNOTS = 257 };
    double knots[KNOTS];
    for (int n = 0; n < KNOTS; n++)
        knots[n] = exp(n / 64.0);
    const trip_codes codes = trip_codes_from_table(knots, KNOTS, 8);
    level_contents c = level_waves;
    c.codes = &codes;
    for (int i = 0; i < 4; i++) {
        level_scene l;
        scene_function *f = calloc(1, sizeof *f);
        assert_non_null(f);
        level_scene_create(&l, &c);
        const double lo = i % 2 ? 5 : 1, hi = i % 2 ? 12 : 55;
        const trip_tf_point points[] = { { .value = lo, .colour = { 0.2, 0.5, 1, 0 } },
                                         { .value = 0.5 * (lo + hi),
                                           .colour = { 1, 0.4, 0.1, 0.2 } },
                                         { .value = hi, .colour = { 1, 1, 0.6, 0.02 } } };
        scene_use_function(&l.at, f, points, 3);
        assert_non_null(f->draw.of_stored);
        trip_settings settings = level_scene_settings();
        settings.kernel = i / 2 ? TRIP_KERNEL_CUBIC : TRIP_KERNEL_LINEAR;
        for (int number = 0; number < 3; number++) {
            const trip_camera_params view = level_scene_view(&l, number, PIXELS);
            compare("uneven codes", &l, &view, &settings);
        }
        level_scene_destroy(&l);
        free(f);
    }
}

/* ---- the same bits ---- */

static unsigned no_deviation(void *user, int i, int j, int k)
{
    (void)user, (void)i, (void)j, (void)k;
    return 0;
}

static void a_deviation_of_0_changes_no_bit(void **state)
{
    (void)state;
    level_scene with, without;
    level_contents c = level_waves;
    c.deviation = no_deviation;
    level_scene_waves(&with, &c);
    c.deviation = NULL;
    level_scene_waves(&without, &c);
    for (int number = 0; number < 3; number++) {
        const trip_camera_params view = level_scene_view(&with, number, PIXELS);
        const trip_settings settings = level_scene_settings();
        scene_picture a = scene_draw(&with.at, &gl, &view, &settings);
        scene_picture b = scene_draw(&without.at, &gl, &view, &settings);
        assert_memory_equal(a.rgba, b.rgba, 16 * PIXELS * PIXELS);
        scene_picture_free(&a);
        scene_picture_free(&b);
    }
    level_scene_destroy(&with);
    level_scene_destroy(&without);
}

/* A frame to draw again and again. */
typedef struct bench {
    const scene *scene;
    trip_renderer *renderer;
    trip_reader *reader;
    trip_camera camera;
    trip_settings settings;
    trip_plan plan;
    trip_frame frame;
} bench;

static void set_up(bench *b, const level_scene *l, const trip_camera_params *view)
{
    const scene *s = &l->at;
    *b = (bench){ .scene = s, .settings = level_scene_settings() };
    assert_int_equal(trip_gl_create(&b->renderer, s->budget), 0);
    assert_int_equal(trip_camera_make(&b->camera, view, &s->data->index_to_world), 0);
    assert_int_equal(
        trip_plan_make(&b->plan, s->data, &b->camera, &b->settings, s->table, s->budget), 0);
    assert_true(b->plan.blurs);
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
    static float whole[4 * PIXELS * PIXELS], rgba[4 * PIXELS * PIXELS];
    level_scene l;
    bench b;
    level_scene_waves(&l, &level_waves);
    const trip_camera_params view = level_scene_view(&l, 0, PIXELS);
    set_up(&b, &l, &view);
    const int all = draw_in_steps(&b, INT_MAX, whole);
    for (int max = 1; max < all; max += all / 4) {
        assert_int_equal(draw_in_steps(&b, max, rgba), max);
        memset(rgba, 0, sizeof rgba);
        assert_int_equal(draw_in_steps(&b, INT_MAX, rgba), all);
        assert_memory_equal(rgba, whole, sizeof rgba);
    }
    put_away(&b);
    level_scene_destroy(&l);
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
    const size_t max = (size_t)(trip_budget_left_bytes(b->scene->budget) - left);
    void *taken = trip_budget_take(b->scene->budget, max);
    assert_non_null(taken);
    last_line[0] = 0;
    trip_report_redirect(keep_line, NULL);
    const int status = trip_frame_draw(b->renderer, b->reader, &b->frame, rgba, NULL, &stats);
    trip_report_redirect(NULL, NULL);
    trip_budget_release(b->scene->budget, taken, max);
    return status;
}

/* A sheet takes 6 bytes a voxel, almost 1 MiB. The blurred function takes 10 MiB, and 4 MiB more
 * while it is loaded. */
static void memory_changes_no_bit_and_too_little_is_refused(void **state)
{
    (void)state;
    static float rgba[2][4 * PIXELS * PIXELS];
    level_scene l;
    level_contents wide = level_waves;
    wide.dims[0] = 14;
    wide.dims[1] = wide.dims[2] = 400;
    level_scene_waves(&l, &wide);
    const trip_camera_params view = scene_view(&l.at, trip_v3(1, 0.1, 0.1), 160, 140, PIXELS);
    int drawn = 0, of_function = 0, of_sheets = 0;
    for (uint64_t mib = 64; mib >= 4; mib -= mib > 32 ? 16 : 2) {
        bench b;
        set_up(&b, &l, &view);
        const int status = draw_with(&b, mib << 20, rgba[drawn > 0]);
        drawn += status == 0;
        of_function += strstr(last_line, "transfer function") && strstr(last_line, "--memory");
        of_sheets += strstr(last_line, "sheets") && strstr(last_line, "--memory");
        assert_true(status == 0 || (status < 0 && strstr(last_line, "raise --memory")));
        if (status == 0 && drawn > 1)
            assert_memory_equal(rgba[0], rgba[1], sizeof rgba[0]);
        if (status < 0) { /* the renderer still draws with enough memory */
            assert_int_equal(draw_with(&b, 64 << 20, rgba[1]), 0);
            assert_memory_equal(rgba[0], rgba[1], sizeof rgba[0]);
        }
        put_away(&b);
    }
    print_message("%d drew; %d functions and %d sheets did not fit\n", drawn, of_function,
                  of_sheets);
    assert_true(drawn > 3 && of_function > 0);
    assert_true(rgba[0][4 * (PIXELS / 2 * PIXELS + PIXELS / 2) + 3] > 0.05F);
    level_scene_destroy(&l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_of_frame_agrees_with_the_reference),
        cmocka_unit_test(shadows_agree_with_the_reference),
        cmocka_unit_test(narrow_opaque_bands_agree_with_the_reference),
        cmocka_unit_test(values_that_only_deviations_show_are_drawn),
        cmocka_unit_test(codes_beyond_the_table_agree_with_the_reference),
        cmocka_unit_test(grids_of_any_shape_agree_with_the_reference),
        cmocka_unit_test(uneven_codes_agree_with_the_reference),
        cmocka_unit_test(a_deviation_of_0_changes_no_bit),
        cmocka_unit_test(frames_cancelled_anywhere_leave_the_next_unchanged),
        cmocka_unit_test(memory_changes_no_bit_and_too_little_is_refused),
    };
    if (!scene_has_gl())
        return 77;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
