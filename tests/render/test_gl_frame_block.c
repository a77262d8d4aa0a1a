/* The values that the gl renderer computes for a frame before it draws. The test needs no OpenGL.
 */
#include "gl/frame_block.h"
#include "splat.h"
#include "test.h"
#include "weight.h"

static double between(double lo, double hi)
{
    return lo + (hi - lo) * test_random();
}

static trip_vec3 random_vector(double size)
{
    return trip_v3(between(-size, size), between(-size, size), between(-size, size));
}

/* Returns a random view of a grid of any shape. */
static trip_camera random_camera(bool ortho)
{
    trip_camera c;
    trip_affine grid = trip_affine_identity();
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            grid.m[i][j] += between(-0.4, 0.4);
    trip_camera_params p = { .eye = random_vector(100),
                             .look = random_vector(20),
                             .up = trip_normalize(random_vector(1)),
                             .fov_degrees = between(2, 170),
                             .width = (int)between(20, 900),
                             .height = (int)between(20, 900),
                             .ortho_height = ortho ? between(5, 100) : 0 };
    assert_int_equal(trip_camera_make(&c, &p, &grid), 0);
    return c;
}

/* Returns a view in the index space of a kernel with widths that differ by up to `ratio` times.
 * The widest width is 1. */
static trip_splat_frame random_frame(const trip_camera *c, const trip_settings *settings,
                                     double ratio, trip_vec3 *width)
{
    *width = trip_v3(between(1 / ratio, 1), between(1 / ratio, 1), between(1 / ratio, 1));
    const trip_splat_frame f = trip_splat_frame_make(c, settings);
    return trip_splat_frame_scaled(&f, *width);
}

static double clipped(double lo, double hi, double size)
{
    return fmin(hi, size) - fmax(lo, 0);
}

static void from_the_sprite_depth_on_every_support_fits_a_sprite(void **state)
{
    (void)state;
    int checked = 0;
    trip_settings settings = trip_settings_default();
    for (int i = 0; i < 300; i++) {
        trip_camera c = random_camera(false);
        settings.footprint = (trip_footprint)(i % 2);
        trip_vec3 width;
        double ratio = i / 2 % 3 ? between(1, 4) : 1, size = between(16, 300);
        double depth = trip_gl_frame_sprite_depth(&settings, &c, ratio, size);
        for (int k = 0; k < 1000 && isfinite(depth); k++) {
            /* Most splats are just beyond the bound, in the image and beside it. */
            double z = fmax(depth, 1e-3) * (1 + test_random() * test_random());
            trip_vec3 ray =
                trip_camera_ray(&c, between(-1, 2) * c.width, between(-1, 2) * c.height);
            trip_splat_frame f = random_frame(&c, &settings, ratio, &width);
            trip_vec3 voxel = trip_vec3_over(trip_add(c.eye, trip_scale(ray, z)), width);
            trip_splat s;
            if (!trip_splat_project(&f, voxel, &s))
                continue;
            if (s.near && settings.footprint == TRIP_FOOTPRINT_EWA)
                continue; /* these are triangles at any depth */
            /* The number of pixel centres inside is at most the extent plus one. */
            double extent = fmax(clipped(s.x0, s.x1, c.width), clipped(s.y0, s.y1, c.height));
            assert_true(fmax(c.width, c.height) <= size || extent + 1 <= size);
            checked++;
        }
    }
    assert_true(checked > 10000);
}

static void from_the_near_depth_on_no_splat_is_near(void **state)
{
    (void)state;
    int checked = 0, near = 0;
    trip_settings settings = trip_settings_default();
    for (int i = 0; i < 400; i++) {
        trip_camera c = random_camera(i % 4 == 3);
        settings.footprint = (trip_footprint)(i % 2);
        trip_vec3 width;
        double ratio = i / 4 % 3 ? between(1, 20) : 1;
        double depth = trip_gl_frame_near_depth(&settings, &c, ratio);
        for (int k = 0; k < 1000 && isfinite(depth); k++) {
            double z = fmax(depth, 1e-3) * (k % 4 ? 1 + test_random() * test_random() : 0.2);
            trip_vec3 ray = trip_camera_ray(&c, between(0, 1) * c.width, between(0, 1) * c.height);
            trip_vec3 at = trip_add(c.eye, trip_scale(ray, z));
            if (c.ortho) /* rays begin at every position of the eye's plane */
                at = trip_add(trip_add(c.eye, trip_scale(c.r0, z)),
                              trip_scale(c.rx, between(0, 1) * c.width));
            trip_splat_frame f = random_frame(&c, &settings, ratio, &width);
            trip_splat s;
            if (!trip_splat_project(&f, trip_vec3_over(at, width), &s))
                continue;
            assert_true(!s.near || k % 4 == 0);
            checked++;
            near += s.near;
        }
    }
    assert_true(checked > 10000 && near > 1000);
}

static void a_small_image_needs_no_triangles_and_a_tiny_sprite_is_no_use(void **state)
{
    (void)state;
    trip_settings settings = trip_settings_default();
    trip_camera c = random_camera(false);
    assert_true(trip_gl_frame_sprite_depth(&settings, &c, 1, 900) == 0);
    assert_true(trip_gl_frame_sprite_depth(&settings, &c, 1, 1) == HUGE_VAL);
}

static void effects_are_requested_only_if_the_frame_needs_them(void **state)
{
    (void)state;
    trip_settings settings = trip_settings_default();
    trip_plan plan = { .planes = 1u << TRIP_PLANE_VOXELS };
    trip_affine grid = trip_affine_identity();
    trip_camera_params p = {
        .eye = { 50, 40, 30 }, .up = { 0, 0, 1 }, .fov_degrees = 60, .width = 100, .height = 80
    };
    trip_camera c;
    trip_dataset data = { .header.normal_bytes = 4 };
    trip_frame frame = { .data = &data, .camera = &c, .settings = &settings, .plan = &plan };
    assert_int_equal(trip_camera_make(&c, &p, &grid), 0);
    assert_int_equal(trip_gl_frame_effects(&frame, &c, 0), 0);

    settings.effects = (trip_effects){ .shadows = true };
    assert_int_equal(trip_gl_frame_effects(&frame, &c, 0), TRIP_GL_SHADOWS);
    settings.effects = (trip_effects){ .occlusion = true, .cueing = 0.5 };
    assert_int_equal(trip_gl_frame_effects(&frame, &c, 0), TRIP_GL_OCCLUSION | TRIP_GL_CUED);
    settings.effects = (trip_effects){ .emission = true };
    assert_int_equal(trip_gl_frame_effects(&frame, &c, 0), TRIP_GL_EMISSION);
    settings.effects = (trip_effects){ 0 };

    plan.planes |= 1u << TRIP_PLANE_NORMALS;
    assert_int_equal(trip_gl_frame_effects(&frame, &c, 0), TRIP_GL_SHADED | TRIP_GL_HEADLIGHT);
    data.header.normal_bytes = 3;
    assert_int_equal(trip_gl_frame_effects(&frame, &c, 0),
                     TRIP_GL_SHADED | TRIP_GL_HEADLIGHT | TRIP_GL_COMPACT);
    settings.shading = false;
    settings.indexed = true;
    assert_int_equal(trip_gl_frame_effects(&frame, &c, 0), TRIP_GL_INDEXED);

    grid.m[1][1] = 1.01;
    assert_int_equal(trip_camera_make(&c, &p, &grid), 0);
    assert_int_equal(trip_gl_frame_effects(&frame, &c, 0), TRIP_GL_INDEXED | TRIP_GL_ANISOTROPIC);
    const double line[] = { 0, 1, 2 };
    data.coordinates = trip_coordinates_make((const double *const[]){ line, line, line },
                                             (const int64_t[]){ 3, 3, 3 });
    grid.m[1][1] = 1;
    assert_int_equal(trip_camera_make(&c, &p, &grid), 0);
    assert_int_equal(trip_gl_frame_effects(&frame, &c, 0),
                     TRIP_GL_INDEXED | TRIP_GL_ANISOTROPIC | TRIP_GL_UNEVEN);
    data.coordinates = (trip_coordinates){ .along = { NULL } };
    p.ortho_height = 50;
    assert_int_equal(trip_camera_make(&c, &p, &grid), 0);
    assert_int_equal(trip_gl_frame_effects(&frame, &c, 0),
                     TRIP_GL_INDEXED | TRIP_GL_PARALLEL | TRIP_GL_UNCULLED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(from_the_sprite_depth_on_every_support_fits_a_sprite),
        cmocka_unit_test(from_the_near_depth_on_no_splat_is_near),
        cmocka_unit_test(a_small_image_needs_no_triangles_and_a_tiny_sprite_is_no_use),
        cmocka_unit_test(effects_are_requested_only_if_the_frame_needs_them),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
