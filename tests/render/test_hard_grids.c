/* Grids that are difficult for numbers: stretched, sheared or far from the world's origin, of one
 * voxel, of none, and of more voxels than 32 bits can count. */
#include "hard.h"
#include "test.h"
#include "writer.h"

#include <stdlib.h>

enum { SIZE = 16 };

/* Returns a view of the centre that shows the whole grid. `direction` is in index space. */
static hard_view view_of(const scene *s, const char *label, trip_vec3 direction, bool ortho)
{
    hard_view v = { .name = label, .settings = hard_settings(), .forms = HARD_ALL, .shows = true };
    const uint64_t *dims = s->data->header.dims;
    const trip_affine *world = &s->data->index_to_world;
    double half = 0;
    for (int a = 0; a < 3; a++) {
        trip_vec3 edge = trip_v3(a == 0, a == 1, a == 2);
        half = fmax(half, 0.5 * (double)dims[a] * trip_length(trip_affine_vector(world, edge)));
    }
    v.camera = scene_view(s, trip_affine_vector(world, direction), 2.5 * half, 50, SIZE);
    v.camera.ortho_height = ortho ? 2 * half : 0;
    return v;
}

static void check_grid(const char *label, trip_affine world, const int64_t dims[3])
{
    const trip_vec3 directions[] = { { 0.3, -1, 0.4 }, { 1, 0.1, 0.2 }, { 0, 0, 1 }, { 1, 1, 1 } };
    scene s;
    hard_lumps(&s, dims, &world);
    for (int i = 0; i < 4; i++) {
        hard_view v = view_of(&s, label, directions[i], i % 2);
        v.settings.shading = i == 1;
        v.gl = i < 2 ? HARD_SPLATS | HARD_POST : 0;
        v.shows = false;
        hard_check(&s, &v);
    }
    scene_destroy(&s);
}

static trip_affine scaled(double x, double y, double z, double offset)
{
    return (trip_affine){ { { x, 0, 0, offset }, { 0, y, 0, -offset }, { 0, 0, z, offset } } };
}

static void spacings_may_differ_a_thousandfold(void **state)
{
    (void)state;
    const int64_t dims[3] = { 12, 11, 10 };
    check_grid("1 : 1 : 1000", scaled(1, 1, 1000, 0), dims);
    check_grid("1 : 1000 : 1", scaled(0.01, 10, 0.01, 0), dims);
    check_grid("1000 : 1 : 1000", scaled(1000, 1, 1000, 0), dims);
}

static void shear_may_be_nearly_singular(void **state)
{
    (void)state;
    const int64_t dims[3] = { 12, 11, 10 };
    /* The angle between the first two axes is 0.06 and 0.006 degrees. */
    for (double tilt = 1e-3; tilt > 5e-5; tilt /= 10) {
        trip_affine sheared = { { { 1, 1, 0, 2 }, { 0, tilt, 0.3, -1 }, { 0, 0, 1, 3 } } };
        check_grid("nearly singular", sheared, dims);
    }
}

static void small_voxels_far_away_are_distinguished(void **state)
{
    (void)state;
    const int64_t dims[3] = { 12, 11, 10 };
    check_grid("voxels of 1e-3 at 1e7", scaled(1e-3, 1e-3, 1e-3, 1e7), dims);
    check_grid("voxels of 1e-3 at 1e10", scaled(1e-3, 1e-3, 1e-3, 1e10), dims);
}

/* Extinctions are floats. A voxel is refused if a float cannot hold its extinction. */
static void voxels_too_small_or_large_for_floats_are_refused(void **state)
{
    (void)state;
    const double lengths[] = { 1e-90, 1e-33, 1e33, 1e90 };
    for (int i = 0; i < 4; i++) {
        const trip_affine world = scaled(lengths[i], lengths[i], lengths[i], 0);
        const trip_camera_params view = { .eye = { 0, 0, 20 * lengths[i] },
                                          .look = { 0, 0, 0 },
                                          .up = { 0, 1, 0 },
                                          .fov_degrees = 30,
                                          .width = SIZE,
                                          .height = SIZE };
        trip_camera camera;
        test_catch_reports();
        assert_int_equal(trip_camera_make(&camera, &view, &world), TRIP_USAGE);
        assert_one_report("world units long");
    }
}

static scene_picture draw_flat(const scene *s, const scene_renderer *r, int axis, unsigned form)
{
    const trip_vec3 along = { axis == 0, axis == 1, axis == 2 };
    hard_view v = view_of(s, "flat", along, true);
    return hard_draw(s, r, &v, form);
}

static void expect_post_refused(const scene *s, int axis)
{
    const trip_vec3 along = { axis == 0, axis == 1, axis == 2 };
    hard_view v = view_of(s, "flat", along, true);
    trip_camera camera;
    trip_plan plan;
    v.settings.classify = TRIP_CLASSIFY_POST;
    assert_int_equal(trip_camera_make(&camera, &v.camera, &s->data->index_to_world), 0);
    test_catch_reports();
    assert_true(trip_plan_make(&plan, s->data, &camera, &v.settings, s->table, s->budget) < 0);
    assert_one_report("is one voxel thick along");
}

/* All voxels have opacity 0.3. `post` has no cells in such a grid. */
static void a_grid_may_be_one_voxel_thick(void **state)
{
    (void)state;
    for (int axis = 0; axis < 3; axis++) {
        scene s;
        scene_params params = { .dims = { 14, 14, 14 } };
        params.dims[axis] = 1;
        scene_create(&s, &params);
        scene_colour(&s, 65535, 65535, 1, 0.5, 0, 0.3);
        for (const scene_renderer *r = scene_renderers(); r->name; r++)
            for (unsigned form = 1; form < HARD_POST; form *= 2) {
                scene_picture p = draw_flat(&s, r, axis, form);
                double alpha = (double)scene_pixel(&p, SIZE / 2, SIZE / 2)[3];
                if (!(fabs(alpha - 0.3) < 0.002))
                    fail_msg("%s, thin along %d, form %u: %g", r->name, axis, form, alpha);
                scene_picture_free(&p);
            }
        expect_post_refused(&s, axis);
        scene_destroy(&s);
    }
}

static bool none(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)i;
    (void)j;
    (void)k;
    (void)code;
    (void)gradient;
    return false;
}

/* Compares with the integral of one kernel, and with an empty picture. */
static void a_grid_may_be_one_voxel_or_empty(void **state)
{
    (void)state;
    const double sigma = 2 / TRIP_CUTOFF, k2 = TRIP_CUTOFF * TRIP_CUTOFF, edge = exp(-k2 / 2);
    const double peak =
        (1 - edge) / (6.28318530717958647692 * sigma * sigma) / (1 - edge * (1 + k2 / 2));
    for (int empty = 0; empty < 2; empty++) {
        const int64_t side = empty ? 5 : 1;
        scene s;
        scene_create(&s,
                     &(scene_params){ .dims = { side, side, side }, .voxel = empty ? none : NULL });
        scene_colour(&s, 0, 65535, 1, 0.5, 0, 0.9);
        for (const scene_renderer *r = scene_renderers(); r->name; r++)
            for (unsigned form = 1; form < HARD_POST; form *= 2) {
                hard_view v = view_of(&s, "one voxel", trip_v3(0.3, 1, 0.2), true);
                v.camera.eye =
                    trip_add(v.camera.look, trip_scale(trip_sub(v.camera.eye, v.camera.look), 9));
                v.camera.width = v.camera.height = 101;
                scene_picture p = hard_draw(&s, r, &v, form);
                double alpha = (double)scene_pixel(&p, 50, 50)[3];
                double expected = empty ? 0 : 1 - pow(0.1, peak);
                if (!(fabs(alpha - expected) < 2e-3))
                    fail_msg("%s, form %u: %g, expected %g", r->name, form, alpha, expected);
                scene_picture_free(&p);
            }
        scene_destroy(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spacings_may_differ_a_thousandfold),
        cmocka_unit_test(shear_may_be_nearly_singular),
        cmocka_unit_test(small_voxels_far_away_are_distinguished),
        cmocka_unit_test(voxels_too_small_or_large_for_floats_are_refused),
        cmocka_unit_test(a_grid_may_be_one_voxel_thick),
        cmocka_unit_test(a_grid_may_be_one_voxel_or_empty),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
