#include "test.h"

#include "splat.h"

/* Returns a view of the origin from `distance` in a random direction, with a random map of the
 * grid. */
static trip_splat_frame random_frame(double distance, double fov, bool ortho)
{
    trip_camera_params p = { .look = { 0, 0, 0 },
                             .up = { test_random(), test_random(), 1 },
                             .fov_degrees = fov,
                             .ortho_height = ortho ? distance : 0,
                             .width = 400,
                             .height = 300 };
    trip_vec3 d = { test_random() - 0.5, test_random() - 0.5, test_random() - 0.5 };
    p.eye = trip_scale(trip_normalize(d), distance);
    trip_affine m = trip_affine_identity();
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m.m[i][j] += 0.6 * (test_random() - 0.5);
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &p, &m), 0);
    trip_settings s = trip_settings_default();
    return trip_splat_frame_make(&c, &s);
}

/* Returns the distance in index space from v to the ray of a pixel position, by the plain formula.
 */
static double distance_to_ray(const trip_camera *c, trip_vec3 v, double x, double y)
{
    trip_vec3 origin = c->eye, ray = trip_camera_ray(c, x, y);
    if (c->ortho)
        origin = trip_add(origin, trip_add(trip_scale(c->rx, x), trip_scale(c->ry, y)));
    return trip_length(trip_cross(trip_sub(v, origin), ray)) / trip_length(ray);
}

static void without_low_pass_the_radius_is_the_distance_to_the_ray_in_sigmas(void **state)
{
    (void)state;
    for (int i = 0; i < 200; i++) {
        trip_splat_frame f = random_frame(30, 20 + i % 120, i % 2);
        f.low_pass2 = 0;
        trip_vec3 v = { test_random() * 6, test_random() * 6, test_random() * 6 };
        trip_splat s;
        if (!trip_splat_project(&f, v, &s))
            continue;
        for (int j = 0; j < 20; j++) {
            double x = s.x0 + (s.x1 - s.x0) * test_random();
            double y = s.y0 + (s.y1 - s.y0) * test_random();
            double d = distance_to_ray(&f.camera, v, x, y) / f.sigma;
            assert_close(trip_splat_radius2(&f, &s, x, y), d * d, 1e-7);
        }
        assert_close(trip_splat_radius2(&f, &s, s.x, s.y), 0, 1e-12);
        assert_close(s.radius, f.sigma * TRIP_CUTOFF, 1e-12);
    }
}

static void the_support_touches_its_bounds_and_does_not_pass_them(void **state)
{
    (void)state;
    for (int i = 0; i < 200; i++) {
        trip_splat_frame f = random_frame(20, 20 + i % 120, i % 2);
        trip_vec3 v = { test_random() * 6, test_random() * 6, test_random() * 6 };
        trip_splat s;
        if (!trip_splat_project(&f, v, &s))
            continue;
        double nearest[4] = { 1e9, 1e9, 1e9, 1e9 };
        for (int j = 0; j <= 2000; j++) {
            double x = s.x0 + (s.x1 - s.x0) * j / 2000, y = s.y0 + (s.y1 - s.y0) * j / 2000;
            nearest[0] = fmin(nearest[0], trip_splat_radius2(&f, &s, s.x0, y));
            nearest[1] = fmin(nearest[1], trip_splat_radius2(&f, &s, s.x1, y));
            nearest[2] = fmin(nearest[2], trip_splat_radius2(&f, &s, x, s.y0));
            nearest[3] = fmin(nearest[3], trip_splat_radius2(&f, &s, x, s.y1));
        }
        for (int side = 0; side < 4; side++)
            assert_close(nearest[side], f.cutoff2, 1e-4);
    }
}

static void every_ray_of_the_support_passes_within_the_radius(void **state)
{
    (void)state;
    for (int i = 0; i < 200; i++) {
        trip_splat_frame f = random_frame(400, 20 + i % 120, i % 2);
        trip_vec3 v = { test_random() * 6, test_random() * 6, test_random() * 6 };
        trip_splat s;
        assert_true(trip_splat_project(&f, v, &s));
        double farthest = 0;
        for (int j = 0; j < 4000; j++) {
            double x = s.x0 + (s.x1 - s.x0) * test_random();
            double y = s.y0 + (s.y1 - s.y0) * test_random();
            if (trip_splat_radius2(&f, &s, x, y) <= f.cutoff2)
                farthest = fmax(farthest, distance_to_ray(&f.camera, v, x, y));
        }
        assert_true(farthest <= s.radius * (1 + 1e-9));
        assert_true(farthest > 0.9 * s.radius);
    }
}

/* Over the plane perpendicular to the ray, the footprint's integral is the mass of the splat, the
 * volume of one voxel. In a parallel view the low-pass filter keeps this integral in pixels at any
 * zoom. */
static void the_footprint_integrates_to_one_voxel_at_any_zoom(void **state)
{
    (void)state;
    for (int i = 0; i < 12; i++) {
        trip_splat_frame f = random_frame(30 * pow(2, i - 3), 0, true);
        trip_splat s;
        assert_true(trip_splat_project(&f, trip_v3(0.3, 0.1, 0.2), &s));
        double sum = 0;
        const int n = 400;
        double sx = (s.x1 - s.x0) / n, sy = (s.y1 - s.y0) / n;
        for (int j = 0; j < n * n; j++) {
            double x = s.x0 + (j % n + 0.5) * sx, y = s.y0 + ((double)(j / n) + 0.5) * sy;
            double m = trip_splat_radius2(&f, &s, x, y);
            if (m <= f.cutoff2)
                sum += s.amplitude * (exp(-m / 2) - exp(-f.cutoff2 / 2)) * sx * sy;
        }
        /* The index-space area of a pixel, perpendicular to the ray. */
        trip_vec3 pixel = trip_cross(f.camera.rx, f.camera.ry);
        double area = fabs(trip_dot(pixel, trip_normalize(f.camera.r0)));
        assert_close(sum * area, 1, 2e-3);
    }
}

static void minified_splats_are_as_wide_as_the_low_pass(void **state)
{
    (void)state;
    trip_splat_frame f = random_frame(1e7, 0, true);
    trip_splat s;
    assert_true(trip_splat_project(&f, trip_v3(0, 0, 0), &s));
    assert_close(s.x1 - s.x0, 2 * TRIP_CUTOFF * TRIP_LOW_PASS_PX, 1e-4);
    assert_close(s.y1 - s.y0, 2 * TRIP_CUTOFF * TRIP_LOW_PASS_PX, 1e-4);
}

static void a_round_splat_before_an_upright_grid_is_a_circle_of_known_size(void **state)
{
    (void)state;
    trip_camera_params p = {
        .eye = { 0, -10, 0 }, .up = { 0, 0, 1 }, .fov_degrees = 90, .width = 2000, .height = 2000
    };
    trip_affine m = trip_affine_identity();
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &p, &m), 0);
    trip_settings settings = trip_settings_default();
    trip_splat_frame f = trip_splat_frame_make(&c, &settings);
    f.low_pass2 = 0;
    trip_splat s;
    assert_true(trip_splat_project(&f, trip_v3(0, 0, 0), &s));
    /* A ball of radius 2 at distance 10 has the half angle asin(0.2). 1000 px is tan 45 degrees. */
    double half = 1000 * tan(asin(0.2));
    assert_close(s.x0, 1000 - half, 1e-9);
    assert_close(s.x1, 1000 + half, 1e-9);
    assert_close(s.y0, 1000 - half, 1e-9);
    assert_close(s.y1, 1000 + half, 1e-9);
    assert_close(s.z, 10, 1e-12);
}

/* Evaluates the formulas of splat.h for z > 0, whether or not the support is an ellipse. */
static double radius2_by_covariance(const trip_splat_frame *f, trip_vec3 voxel, double x, double y)
{
    const trip_camera *c = &f->camera;
    trip_vec3 v = trip_sub(voxel, c->eye), p = trip_camera_ray(c, x, y);
    double z = trip_dot(c->forward, v);
    trip_vec3 ray = trip_scale(v, 1 / z), a = trip_cross(v, c->rx), b = trip_cross(v, c->ry);
    double scale = f->sigma * f->sigma * trip_dot(ray, ray);
    double det = trip_dot(a, a) * trip_dot(b, b) - trip_dot(a, b) * trip_dot(a, b);
    double xx = scale * trip_dot(b, b) / det + f->low_pass2;
    double yy = scale * trip_dot(a, a) / det + f->low_pass2;
    double xy = -scale * trip_dot(a, b) / det;
    double dx = x - trip_dot(c->to_x, v) / z, dy = y - trip_dot(c->to_y, v) / z;
    double q = (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
    return q * trip_dot(ray, ray) / trip_dot(p, p);
}

static void near_splats_have_the_numbers_of_far_splats(void **state)
{
    (void)state;
    int near = 0;
    for (int i = 0; i < 400; i++) {
        trip_splat_frame f = random_frame(3, 40 + i % 130, false);
        double size = i % 4 ? 1 : 100; /* of a pixel; one in four pictures is 4 x 3 pixels */
        f.camera.width = (int)(400 / size);
        f.camera.height = (int)(300 / size);
        f.camera.rx = trip_scale(f.camera.rx, size);
        f.camera.ry = trip_scale(f.camera.ry, size);
        f.camera.to_x = trip_scale(f.camera.to_x, 1 / size);
        f.camera.to_y = trip_scale(f.camera.to_y, 1 / size);
        trip_vec3 v = { 4 * test_random() - 2, 4 * test_random() - 2, 4 * test_random() - 2 };
        trip_splat s;
        if (!trip_splat_project(&f, v, &s) || !s.near || s.z < 0.01)
            continue;
        near++;
        for (int j = 0; j < 20; j++) {
            double x = f.camera.width * test_random(), y = f.camera.height * test_random();
            double m = trip_splat_radius2(&f, &s, x, y);
            if (isfinite(m))
                assert_close(m, radius2_by_covariance(&f, v, x, y), 1e-6);
        }
    }
    assert_in_range(near, 100, 400);
}

/* Splats lie in front of the eye and behind it, without low-pass filter. */
static void near_splats_have_the_distance_at_which_a_ray_passes(void **state)
{
    (void)state;
    int behind = 0;
    for (int i = 0; i < 400; i++) {
        trip_splat_frame f = random_frame(10, 20 + i % 150, false);
        f.low_pass2 = 0;
        trip_vec3 c = { 4 * test_random() - 2, 4 * test_random() - 2, 4 * test_random() - 2 };
        trip_vec3 v = trip_add(f.camera.eye, c);
        trip_splat s;
        if (!trip_splat_project(&f, v, &s))
            continue;
        behind += s.z < 0;
        for (int j = 0; j < 20; j++) {
            double x = 400 * test_random(), y = 300 * test_random();
            trip_vec3 ray = trip_normalize(trip_camera_ray(&f.camera, x, y));
            double along = trip_dot(ray, c) / f.sigma, front = trip_splat_front(&f, &s, x, y);
            double d = distance_to_ray(&f.camera, v, x, y) / f.sigma, k = TRIP_CUTOFF;
            double share = 0.5 * (1 + erf(along / sqrt(2)) / erf(k / sqrt(2)));
            if (!s.near && d > k)
                continue;
            assert_close(front, fmin(1, fmax(0, share)), 1e-9);
            if (front > 0)
                assert_close(trip_splat_radius2(&f, &s, x, y), d * d, 1e-7);
            else
                assert_true(trip_splat_radius2(&f, &s, x, y) > f.cutoff2);
        }
    }
    assert_in_range(behind, 50, 400);
}

/* Checks every pixel of pictures of any size and angle. `drawn` may be false only if no pixel is
 * in the support. */
static void no_pixel_of_a_support_lies_out_of_its_bounds(void **state)
{
    (void)state;
    int covered = 0;
    for (int i = 0; i < 4000; i++) {
        const int sizes[4][2] = { { 64, 48 }, { 1, 1 }, { 4, 3 }, { 90, 2 } };
        const double angles[5] = { 20, 90, 120, 150, 175 };
        trip_camera_params p = { .up = { 0.1, 0.2, 1 },
                                 .look = { 1, 0.4, -0.3 },
                                 .fov_degrees = angles[i % 5],
                                 .ortho_height = i % 7 == 0 ? 5 : 0,
                                 .width = sizes[i % 4][0],
                                 .height = sizes[i % 4][1] };
        trip_affine m = trip_affine_identity();
        for (int n = 0; n < 9; n++)
            m.m[n / 3][n % 3] += i % 3 ? 0.8 * (test_random() - 0.5) : 0;
        trip_camera c;
        assert_int_equal(trip_camera_make(&c, &p, &m), 0);
        trip_settings settings = trip_settings_default();
        settings.kernel_radius = 0.5 + 3 * test_random();
        trip_splat_frame f = trip_splat_frame_make(&c, &settings);
        double far = i % 11 ? 4 : 30;
        trip_vec3 v = { test_random() - 0.5, test_random() - 0.5, test_random() - 0.5 };
        trip_splat s;
        bool drawn = trip_splat_project(&f, trip_scale(v, 2 * far), &s);
        assert_false(trip_splat_is_broken(&s));
        for (int n = 0; n < c.width * c.height && (drawn || s.near); n++) {
            double x = n % c.width + 0.5, y = n / c.width + 0.5;
            if (trip_splat_radius2(&f, &s, x, y) > f.cutoff2)
                continue;
            covered++;
            const double room = 1e-9 * (c.width + c.height);
            assert_true(drawn && x >= s.x0 - room && x <= s.x1 + room && y >= s.y0 - room &&
                        y <= s.y1 + room);
        }
    }
    assert_true(covered > 10000);
}

/* While the eye moves through a voxel, no value may jump. */
static void a_splat_changes_gradually_as_the_eye_moves_through_it(void **state)
{
    (void)state;
    trip_affine identity = trip_affine_identity();
    trip_settings settings = trip_settings_default();
    const double pixels[3][2] = { { 32.5, 24.5 }, { 3.5, 40.5 }, { 60.5, 1.5 } };
    double before[3] = { 0 }, first[3] = { 0 }, step = 0.002;
    for (int i = 0; i < 6000; i++) {
        trip_camera_params p = { .eye = { -6 + step * i, 0.3, -0.2 },
                                 .up = { 0, 0, 1 },
                                 .fov_degrees = 110,
                                 .width = 64,
                                 .height = 48 };
        p.look = trip_add(p.eye, trip_v3(1, 0, 0));
        trip_camera c;
        assert_int_equal(trip_camera_make(&c, &p, &identity), 0);
        trip_splat_frame f = trip_splat_frame_make(&c, &settings);
        trip_splat s;
        bool drawn = trip_splat_project(&f, trip_v3(0, 0, 0), &s);
        for (int j = 0; j < 3; j++) {
            double x = pixels[j][0], y = pixels[j][1], now = 0;
            double m = drawn ? trip_splat_radius2(&f, &s, x, y) : INFINITY;
            if (m <= f.cutoff2)
                now = trip_splat_front(&f, &s, x, y) * s.amplitude * (exp(-m / 2) - f.edge);
            /* A Gaussian's share changes most quickly at its centre. */
            assert_true(i == 0 || fabs(now - before[j]) < 1.1 * f.amplitude * step / f.sigma);
            before[j] = now;
            first[j] = fmax(first[j], now);
        }
    }
    for (int j = 0; j < 3; j++)
        assert_true(before[j] == 0 && first[j] > 0.05);
}

static void splats_behind_the_eye_or_beside_the_picture_are_not_drawn(void **state)
{
    (void)state;
    trip_camera_params p = {
        .eye = { 0, -10, 0 }, .up = { 0, 0, 1 }, .fov_degrees = 90, .width = 100, .height = 100
    };
    trip_affine m = trip_affine_identity();
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &p, &m), 0);
    trip_settings settings = trip_settings_default();
    trip_splat_frame f = trip_splat_frame_make(&c, &settings);
    f.low_pass2 = 0; /* then the support is the cone around a ball of radius 2 */
    trip_splat s;
    assert_true(trip_splat_project(&f, trip_v3(0, -11, 0), &s));
    assert_false(trip_splat_project(&f, trip_v3(0, -13, 0), &s));
    assert_false(trip_splat_project(&f, trip_v3(50, -10, 0), &s));
    assert_false(trip_splat_project(&f, trip_v3(50, -8.01, 0), &s));
    assert_true(trip_splat_project(&f, trip_v3(0.5, -9, 0), &s));
    assert_true(s.near);
    assert_true(trip_splat_project(&f, trip_v3(0, -7, 0), &s));
    assert_false(s.near);
}

static void a_voxel_in_the_plane_of_the_eye_has_finite_numbers(void **state)
{
    (void)state;
    trip_camera_params p = { .eye = { 60, 50, 55 },
                             .look = { 30, 40, 50 },
                             .up = { 0, 0, 1 },
                             .fov_degrees = 75,
                             .width = 96,
                             .height = 80 };
    trip_affine identity = trip_affine_identity();
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &p, &identity), 0);
    trip_settings settings = trip_settings_default();
    trip_splat_frame f = trip_splat_frame_make(&c, &settings);
    trip_splat s;
    /* (30, 10, 5) . (5, -4, -22) = 0 */
    assert_false(trip_splat_project(&f, trip_v3(65, 46, 33), &s));
    assert_true(fabs(s.z) < 1e-12);
    assert_false(trip_splat_is_broken(&s));
    assert_true(trip_splat_project(&f, trip_v3(60, 50, 55), &s)); /* the eye */
    assert_false(trip_splat_is_broken(&s));
    assert_close(trip_splat_radius2(&f, &s, 3, 70), 0, 1e-12);
    assert_close(trip_splat_front(&f, &s, 3, 70), 0.5, 1e-12);
}

static void the_stretch_is_the_world_length_of_an_index_step_along_the_ray(void **state)
{
    (void)state;
    trip_camera_params p = {
        .eye = { 0, -10, 0 }, .up = { 0, 0, 1 }, .fov_degrees = 90, .width = 100, .height = 100
    };
    trip_affine m = { { { 1, 0, 0, 0 }, { 0, 3, 0, 0 }, { 0, 0, 1, 0 } } };
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &p, &m), 0);
    trip_settings settings = trip_settings_default();
    trip_splat_frame f = trip_splat_frame_make(&c, &settings);
    assert_close(trip_splat_stretch(&f, 50, 50), 3, 1e-12);
    /* At the right edge the world ray is (1, 1, 0), in index space (1, 1/3, 0). */
    assert_close(trip_splat_stretch(&f, 100, 50), sqrt(2) / sqrt(1 + 1.0 / 9), 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_low_pass_the_radius_is_the_distance_to_the_ray_in_sigmas),
        cmocka_unit_test(the_support_touches_its_bounds_and_does_not_pass_them),
        cmocka_unit_test(every_ray_of_the_support_passes_within_the_radius),
        cmocka_unit_test(the_footprint_integrates_to_one_voxel_at_any_zoom),
        cmocka_unit_test(minified_splats_are_as_wide_as_the_low_pass),
        cmocka_unit_test(a_round_splat_before_an_upright_grid_is_a_circle_of_known_size),
        cmocka_unit_test(near_splats_have_the_numbers_of_far_splats),
        cmocka_unit_test(near_splats_have_the_distance_at_which_a_ray_passes),
        cmocka_unit_test(no_pixel_of_a_support_lies_out_of_its_bounds),
        cmocka_unit_test(a_splat_changes_gradually_as_the_eye_moves_through_it),
        cmocka_unit_test(splats_behind_the_eye_or_beside_the_picture_are_not_drawn),
        cmocka_unit_test(a_voxel_in_the_plane_of_the_eye_has_finite_numbers),
        cmocka_unit_test(the_stretch_is_the_world_length_of_an_index_step_along_the_ray),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
