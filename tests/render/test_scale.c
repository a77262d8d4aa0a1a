/* Projection does not depend on scale. Tests volumes in any unit, far from the world's origin, in
 * narrow and wide views. Every renderer and instruction set must agree with the reference. If the
 * scale is a power of two, every bit must be the same. */
#include "cpu/kernels/isa.h"
#include "cpu_scenes.h"
#include "splat.h"
#include "test.h"

#include <stdlib.h>
#include <string.h>

enum { EDGE = 14, SIZE_PX = 40 };

static bool blob(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    double x = i - 6.1, y = j - 6.9, z = k - 7.2, r = sqrt(x * x + y * y + z * z);
    (void)user;
    gradient[0] = 0.05 * x / (r + 1);
    gradient[1] = 0.05 * y / (r + 1);
    gradient[2] = 0.05 * z / (r + 1);
    *code = (unsigned)(scene_hash(i, j, k) & 0xffff);
    return r < 6.5 && (r > 3 || (i + j + k) % 3 == 0);
}

/* `position` has voxels of about this length. Gradients grow as voxels shrink. */
static void create(scene *s, trip_affine position, double voxel)
{
    scene_create(s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                     .index_to_world = position,
                                     .tile_voxels = 16,
                                     .slab_sheets = 8,
                                     .normals = true,
                                     .gradient_scale = 1 / voxel,
                                     .voxel = blob });
    scene_colour(s, 0, 30000, 0.2, 0.5, 1, 0.1);
    scene_colour(s, 30001, 60000, 0.9, 0.4, 0.1, 0.5);
    scene_colour(s, 60001, 65535, 1, 1, 0.6, 0.97);
}

static trip_affine grid(double spacing, double offset)
{
    return (trip_affine){
        { { spacing, 0, 0, offset }, { 0, spacing, 0, -offset }, { 0, 0, spacing, offset } }
    };
}

/* A margin of one sixth of the picture's height remains above and below. */
static trip_camera_params view_of(const scene *s, double voxel, double fov_degrees, bool ortho)
{
    double half = 0.75 * EDGE * voxel, slope = tan(fov_degrees * 3.14159265358979323846 / 360);
    trip_camera_params view =
        scene_view(s, trip_v3(0.6, -1, 0.4), half / slope + 0.2 * half, fov_degrees, SIZE_PX);
    view.ortho_height = ortho ? 2 * half : 0;
    return view;
}

static void expect_alike(const scene *s, const trip_camera_params *view, const char *label)
{
    trip_settings settings = trip_settings_default();
    const scene_renderer *all = scene_renderers();
    scene_picture expected = scene_draw(s, &all[0], view, &settings);
    if (!(scene_max_opaque(&expected) > 0.5))
        fail_msg("%s: the reference shows nothing", label);
    for (const scene_renderer *r = all + 1; r->name; r++) {
        bool cpu = strcmp(r->name, "cpu") == 0;
        for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa += cpu ? 1 : 0) {
            setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
            scene_picture p = scene_draw(s, r, view, &settings);
            double apart = scene_difference(&expected, &p);
            if (!(apart <= r->tolerance))
                fail_msg("%s: %s, %s: %.3f of 1/255", label, r->name, (*isa)->isa, 255 * apart);
            scene_picture_free(&p);
            if (!cpu)
                break;
        }
    }
    unsetenv("TRIPTYCH_ISA");
    scene_picture_free(&expected);
}

static void voxels_of_any_size_agree_with_the_reference(void **state)
{
    (void)state;
    for (int power = -12; power <= 12; power += power == -4 || power == 2 ? 2 : 4) {
        double voxel = pow(10, power);
        char label[64];
        scene s;
        create(&s, grid(voxel, 3 * voxel), voxel);
        for (int ortho = 0; ortho < 2; ortho++) {
            trip_camera_params view = view_of(&s, voxel, 30, ortho);
            snprintf(label, sizeof label, "voxels of %g, %s", voxel,
                     ortho ? "parallel" : "perspective");
            expect_alike(&s, &view, label);
        }
        scene_destroy(&s);
    }
}

static void voxels_of_any_shape_and_size_agree_with_the_reference(void **state)
{
    (void)state;
    for (int power = -12; power <= 12; power += 6) {
        double voxel = pow(10, power);
        trip_affine position = cpu_scenes_sheared();
        for (int i = 0; i < 12; i++)
            position.m[i / 4][i % 4] *= voxel;
        char label[64];
        scene s;
        create(&s, position, voxel);
        trip_camera_params view = view_of(&s, voxel, 40, false);
        snprintf(label, sizeof label, "sheared voxels of %g", voxel);
        expect_alike(&s, &view, label);
        scene_destroy(&s);
    }
}

static void views_of_any_width_agree_with_the_reference(void **state)
{
    (void)state;
    const double degrees[] = { 1e-6, 1e-4, 0.01, 0.1, 1, 10, 90, 150, 175 };
    const double voxels[] = { 1, 1e-12, 100, 1e12 };
    for (int v = 0; v < 4; v++) {
        scene s;
        create(&s, grid(voxels[v], 0), voxels[v]);
        for (size_t i = v; i < sizeof degrees / sizeof degrees[0]; i += v == 0 ? 1 : 4) {
            char label[64];
            trip_camera_params view = view_of(&s, voxels[v], degrees[i], false);
            snprintf(label, sizeof label, "%g degrees, voxels of %g", degrees[i], voxels[v]);
            expect_alike(&s, &view, label);
        }
        scene_destroy(&s);
    }
}

static void a_voxel_may_be_much_larger_than_the_picture(void **state)
{
    (void)state;
    scene s;
    create(&s, grid(1e4, 0), 1e4);
    for (double degrees = 1e-6; degrees < 1; degrees *= 100) {
        char label[64];
        trip_camera_params view = scene_view(&s, trip_v3(0.6, -1, 0.4), 20e4, degrees, SIZE_PX);
        snprintf(label, sizeof label, "%g degrees nearby", degrees);
        expect_alike(&s, &view, label);
    }
    scene_destroy(&s);
}

static void volumes_far_from_the_origin_agree_with_the_reference(void **state)
{
    (void)state;
    const double positions[][2] = { { 1, 1e15 }, { 0.1, 1e12 }, { 1e-3, 1e11 }, { 1e9, 1e15 } };
    for (int i = 0; i < 4; i++) {
        char label[64];
        scene s;
        create(&s, grid(positions[i][0], positions[i][1]), positions[i][0]);
        trip_camera_params view = view_of(&s, positions[i][0], 30, false);
        snprintf(label, sizeof label, "voxels of %g at %g", positions[i][0], positions[i][1]);
        expect_alike(&s, &view, label);
        scene_destroy(&s);
    }
}

/* Draws the blob with voxel size and camera scaled by 2^power. `offset` is in voxels. */
static scene_picture draw_scaled(const scene_renderer *r, int power, double offset, bool ortho)
{
    double voxel = ldexp(1, power);
    trip_settings settings = trip_settings_default();
    scene s;
    create(&s, grid(voxel, offset * voxel), voxel);
    trip_vec3 look = trip_v3(7, 6, 8), from = trip_v3(14, -21, 10);
    trip_vec3 first = trip_v3(offset, -offset, offset);
    trip_camera_params view = { .look = trip_scale(trip_add(first, look), voxel),
                                .eye = trip_scale(trip_add(first, trip_add(look, from)), voxel),
                                .up = { 0, 0, 1 },
                                .fov_degrees = 35,
                                .ortho_height = ortho ? 20 * voxel : 0,
                                .width = SIZE_PX,
                                .height = SIZE_PX };
    scene_picture p = scene_draw(&s, r, &view, &settings);
    scene_destroy(&s);
    return p;
}

static void a_power_of_two_changes_no_bit(void **state)
{
    (void)state;
    const int powers[] = { -40, -13, 13, 40 };
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        for (int ortho = 0; ortho < 2; ortho++) {
            scene_picture one = draw_scaled(r, 0, 0, ortho);
            for (int i = 0; i < 4; i++) {
                scene_picture p = draw_scaled(r, powers[i], 0, ortho);
                if (memcmp(one.rgba, p.rgba, 16 * SIZE_PX * SIZE_PX))
                    fail_msg("%s: voxels of 2^%d differ by %g", r->name, powers[i],
                             scene_difference(&one, &p));
                scene_picture_free(&p);
            }
            scene_picture_free(&one);
        }
    }
}

/* Doubles represent 2^49 and the eye's coordinates there exactly, so that no step may lose
 * precision. */
static void a_position_far_from_the_worlds_origin_changes_no_bit(void **state)
{
    (void)state;
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        scene_picture near = draw_scaled(r, 0, 0, false), far = draw_scaled(r, 0, 0x1p49, false);
        if (memcmp(near.rgba, far.rgba, 16 * SIZE_PX * SIZE_PX))
            fail_msg("%s: differ by %g", r->name, scene_difference(&near, &far));
        scene_picture_free(&near);
        scene_picture_free(&far);
    }
}

/* Draws with a camera that trip_camera_make() would refuse. The frame must fail and report once. */
static void expect_refused(const scene *s, const scene_renderer *renderer, trip_camera *camera)
{
    static float rgba[4 * SIZE_PX * SIZE_PX];
    trip_settings settings = trip_settings_default();
    trip_plan plan;
    trip_renderer *r;
    trip_reader *reader;
    trip_frame_stats stats;
    trip_camera_params view = view_of(s, 1, 30, false);
    trip_camera good;
    assert_int_equal(trip_camera_make(&good, &view, &s->data->index_to_world), 0);
    assert_int_equal(trip_plan_make(&plan, s->data, &good, &settings, s->table, s->budget), 0);
    assert_int_equal(trip_reader_create(&reader, s->data,
                                        &(trip_reader_params){ .planes = plan.planes }, s->budget),
                     0);
    assert_int_equal(renderer->create(&r, s->budget), 0);
    for (unsigned i = 0; i < plan.list_count; i++)
        plan.lists[i].camera = *camera;
    trip_frame frame = {
        .data = s->data, .camera = camera, .settings = &settings, .plan = &plan, .table = s->table
    };
    test_catch_reports();
    assert_int_equal(trip_frame_draw(r, reader, &frame, rgba, NULL, &stats), TRIP_ERROR);
    assert_one_report("not finite");
    r->ops->destroy(r);
    trip_reader_destroy(reader);
    trip_plan_release(&plan, s->budget);
}

static void a_footprint_that_is_not_finite_ends_the_frame(void **state)
{
    (void)state;
    scene s;
    create(&s, grid(1, 0), 1);
    trip_camera_params view = view_of(&s, 1, 30, false);
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        trip_camera none, endless;
        assert_int_equal(trip_camera_make(&none, &view, &s.data->index_to_world), 0);
        endless = none;
        none.to_y.z = NAN;
        expect_refused(&s, r, &none);
        endless.rx.x = 1e200; /* its square overflows, and so do all footprints */
        if (strcmp(r->name, "gl") != 0)
            expect_refused(&s, r, &endless);
    }
    scene_destroy(&s);
}

static void expect_no_view(const trip_camera_params *view, const trip_affine *grid,
                           const char *says)
{
    trip_camera c;
    test_catch_reports();
    assert_int_equal(trip_camera_make(&c, view, grid), TRIP_USAGE);
    assert_one_report(says);
}

static void views_beyond_double_precision_are_refused(void **state)
{
    (void)state;
    trip_camera_params view = { .look = { 5, 5, 5 },
                                .eye = { 5, 5, 0x1p47 },
                                .up = { 0, 1, 0 },
                                .fov_degrees = 30,
                                .width = SIZE_PX,
                                .height = SIZE_PX };
    trip_affine one = grid(1, 0), small = grid(0x1p-60, 0);
    expect_no_view(&view, &one, "voxels from the first voxel");
    view.eye.z = 100;
    expect_no_view(&view, &small, "voxels from the first voxel");
    view.ortho_height = 1e-20;
    expect_no_view(&view, &one, "a pixel is");
    view.ortho_height = 1e30;
    expect_no_view(&view, &one, "a pixel is");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(voxels_of_any_size_agree_with_the_reference),
        cmocka_unit_test(voxels_of_any_shape_and_size_agree_with_the_reference),
        cmocka_unit_test(views_of_any_width_agree_with_the_reference),
        cmocka_unit_test(a_voxel_may_be_much_larger_than_the_picture),
        cmocka_unit_test(volumes_far_from_the_origin_agree_with_the_reference),
        cmocka_unit_test(a_power_of_two_changes_no_bit),
        cmocka_unit_test(a_position_far_from_the_worlds_origin_changes_no_bit),
        cmocka_unit_test(a_footprint_that_is_not_finite_ends_the_frame),
        cmocka_unit_test(views_beyond_double_precision_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
