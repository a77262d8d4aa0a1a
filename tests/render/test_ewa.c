/* EWA volume splatting (render/ewa.h, the footprint EWA of splat.h). Compares the algebra with
 * closed forms and quadrature, pictures with sums of Gaussians, and renderers with the reference.
 */
#include "cpu_scenes.h"
#include "ewa.h"
#include "splat.h"
#include "test.h"
#include "weight.h"

#define PI 3.14159265358979323846

static trip_affine random_map(double size)
{
    trip_affine m = trip_affine_identity();
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m.m[i][j] += size * (test_random() - 0.5);
    return m;
}

static trip_camera camera_of(trip_vec3 eye, trip_vec3 look, double fov, double ortho_height,
                             const trip_affine *map)
{
    trip_camera_params p = { .eye = eye,
                             .look = look,
                             .up = { 0.1, 0.2, 1 },
                             .fov_degrees = fov,
                             .ortho_height = ortho_height,
                             .width = 200,
                             .height = 150 };
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &p, map), 0);
    return c;
}

static trip_covariance random_covariance(double size)
{
    trip_affine m = random_map(1);
    trip_covariance v = trip_covariance_round(size);
    return trip_covariance_mapped(&v, &m);
}

static double gaussian2(const trip_covariance2 *s, double x, double y)
{
    trip_covariance2 c = trip_covariance2_inverse(s);
    return exp(-0.5 * (c.xx * x * x + 2 * c.xy * x * y + c.yy * y * y)) / (2 * PI * sqrt(s->det));
}

/* Evaluates a Gaussian by the cofactors of its inverse, independently of ewa.c. */
static double gaussian3(const trip_covariance *v, trip_vec3 p)
{
    double axx = v->yy * v->zz - v->yz * v->yz, axy = v->xz * v->yz - v->xy * v->zz;
    double axz = v->xy * v->yz - v->xz * v->yy, ayy = v->xx * v->zz - v->xz * v->xz;
    double ayz = v->xy * v->xz - v->xx * v->yz, azz = v->xx * v->yy - v->xy * v->xy;
    double det = v->xx * axx + v->xy * axy + v->xz * axz;
    double q = axx * p.x * p.x + ayy * p.y * p.y + azz * p.z * p.z +
               2 * (axy * p.x * p.y + axz * p.x * p.z + ayz * p.y * p.z);
    return exp(-0.5 * q / det) / sqrt(8 * PI * PI * PI * det);
}

/* Section 4.4: with the eye at the origin, J = [1/u2 0 -u0/u2^2; 0 1/u2 -u1/u2^2; u / |u|]. */
static void the_jacobian_of_a_unit_camera_is_the_papers(void **state)
{
    (void)state;
    trip_affine map = trip_affine_identity();
    trip_camera_params p = { .look = { 0, 0, 1 }, .up = { 0, -1, 0 }, .width = 200, .height = 200 };
    p.fov_degrees = 2 * atan(1) * 180 / PI; /* one unit is 100 pixels at depth 1 */
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &p, &map), 0);
    for (int i = 0; i < 50; i++) {
        trip_vec3 u = { test_random() - 0.5, test_random() - 0.5, 1 + test_random() };
        trip_ray_space j = trip_ray_space_at(&c, u);
        double length = trip_length(u);
        const double expected[9] = { 1 / u.z,
                                     0,
                                     -u.x / (u.z * u.z),
                                     0,
                                     1 / u.z,
                                     -u.y / (u.z * u.z),
                                     u.x / length,
                                     u.y / length,
                                     u.z / length };
        const double rows[9] = { j.x.x / 100, j.x.y / 100, j.x.z / 100, j.y.x / 100, j.y.y / 100,
                                 j.y.z / 100, j.along.x,   j.along.y,   j.along.z };
        for (int k = 0; k < 9; k++)
            assert_close(fabs(rows[k]), fabs(expected[k]), 1e-12);
        assert_close(trip_ray_space_volume(&j), 1e4 * length / (u.z * u.z * u.z), 1e-7);
    }
}

/* Computes finite differences of the coordinates of ray space. */
static void the_jacobian_is_the_derivative_of_ray_space(void **state)
{
    (void)state;
    for (int i = 0; i < 50; i++) {
        trip_affine map = random_map(0.8);
        trip_camera c = camera_of(trip_v3(9, 3, 2), trip_v3(0, 0, 0), 50, 0, &map);
        trip_vec3 at = { test_random() - 12, test_random() - 4, test_random() - 2 };
        trip_ray_space j = trip_ray_space_at(&c, at);
        for (int a = 0; a < 3; a++) {
            const double step = 1e-5;
            trip_vec3 by = { a == 0 ? step : 0, a == 1 ? step : 0, a == 2 ? step : 0 };
            double change[3] = { 0 };
            for (int sign = -1; sign <= 1; sign += 2) {
                trip_vec3 p = trip_add(at, trip_scale(by, sign));
                double z = trip_dot(c.forward, p);
                change[0] += sign * trip_dot(c.to_x, p) / z;
                change[1] += sign * trip_dot(c.to_y, p) / z;
                change[2] += sign * trip_length(trip_affine_vector(&map, p));
            }
            double scale = trip_length(j.x) + trip_length(j.y);
            assert_close(change[0] / (2 * step), trip_component(j.x, a), 1e-7 * scale);
            assert_close(change[1] / (2 * step), trip_component(j.y, a), 1e-7 * scale);
            assert_close(change[2] / (2 * step), trip_component(j.along, a), 1e-7);
        }
    }
}

/* Section 4.2: G_V o M^-1 = |M| G_MVM^T. */
static void a_gaussian_stays_one_under_affine_maps(void **state)
{
    (void)state;
    for (int i = 0; i < 50; i++) {
        trip_affine m = random_map(1), inverse;
        trip_covariance v = random_covariance(1.5), mapped = trip_covariance_mapped(&v, &m);
        trip_vec3 p = { test_random(), test_random(), test_random() };
        assert_true(trip_affine_invert(&m, &inverse));
        assert_close(gaussian3(&v, trip_affine_vector(&inverse, p)),
                     fabs(trip_affine_determinant(&m)) * gaussian3(&mapped, p), 1e-12);
    }
}

/* Section 4.5 for an affine map, by quadrature along the ray. */
static void integrated_covariances_are_those_of_line_integrals(void **state)
{
    (void)state;
    for (int i = 0; i < 30; i++) {
        trip_affine map = random_map(0.8);
        trip_camera c = camera_of(trip_v3(9, 3, 2), trip_v3(0, 0, 0), 0, 30, &map);
        trip_covariance v = random_covariance(1.5);
        trip_ray_space j = trip_ray_space_at(&c, trip_v3(0, 0, 0));
        trip_covariance2 s = trip_covariance_integrated(&v, &j);
        double px = 6 * test_random(), py = 6 * test_random(), sum = 0, step = 0.01;
        double world = trip_length(trip_affine_vector(&map, c.r0));
        trip_vec3 start = trip_add(trip_scale(c.rx, px), trip_scale(c.ry, py));
        for (double t = -20; t < 20; t += step)
            sum += gaussian3(&v, trip_add(start, trip_scale(c.r0, t))) * step * world;
        assert_close(trip_ray_space_volume(&j) * gaussian2(&s, px, py), sum, 1e-9);
        assert_close(s.xx * s.yy - s.xy * s.xy, s.det, 1e-9 * s.xx * s.yy);
    }
}

/* Compares with quadrature of the convolution. */
static void low_passed_covariances_are_those_of_convolutions(void **state)
{
    (void)state;
    for (int i = 0; i < 10; i++) {
        double a = 0.3 + test_random(), b = 0.3 + test_random(), c = 0.2 * (test_random() - 0.5);
        trip_covariance2 s = { a, c, b, a * b - c * c }, h = { 0.16, 0, 0.16, 0.16 * 0.16 };
        trip_covariance2 wide = trip_covariance2_low_passed(&s, 0.16);
        double x = 2 * test_random() - 1, y = 2 * test_random() - 1, sum = 0, step = 0.05;
        for (double u = -4; u < 4; u += step)
            for (double v = -4; v < 4; v += step)
                sum += gaussian2(&s, x - u, y - v) * gaussian2(&h, u, v) * step * step;
        assert_close(gaussian2(&wide, x, y), sum, 1e-9);
    }
}

static void uniform_scaling_widens_the_shortest_axis_to_the_filter(void **state)
{
    (void)state;
    trip_covariance2 thin = { 9, 0, 0.04, 0.36 }, s = trip_covariance2_scaled(&thin, 0.16);
    assert_close(s.yy, 0.16, 1e-12);
    assert_close(s.xx, 36, 1e-12); /* scaled by this factor, unlike in a convolution: 9.16 */
    assert_close(s.det, s.xx * s.yy, 1e-12);
    trip_covariance2 large = { 9, 1, 4, 35 };
    assert_close(trip_covariance2_scaled(&large, 0.16).xx, 9, 0);
}

/* Section 5: as s grows, the footprint approaches the footprint of a disc, T3 T3^T, with T3 of two
 * tangents. */
static void flat_kernels_become_surface_kernels(void **state)
{
    (void)state;
    for (int i = 0; i < 30; i++) {
        trip_affine map = random_map(0.8);
        trip_camera c = camera_of(trip_v3(9, 3, 2), trip_v3(0, 0, 0), 50, 0, &map);
        trip_ray_space j = trip_ray_space_at(&c, trip_v3(-9, -3, -2));
        trip_vec3 n = trip_normalize(trip_v3(test_random(), test_random(), test_random() - 0.5));
        trip_vec3 u = trip_normalize(trip_cross(n, trip_v3(1, 0.3, 0.2))), v = trip_cross(n, u);
        trip_covariance flat = trip_covariance_flattened(0.6, n, 1);
        trip_covariance2 s = trip_covariance_integrated(&flat, &j);
        const double t[2][2] = { { trip_dot(j.x, u), trip_dot(j.x, v) },
                                 { trip_dot(j.y, u), trip_dot(j.y, v) } };
        double det = t[0][0] * t[1][1] - t[0][1] * t[1][0];
        assert_close(s.xx, 0.36 * (t[0][0] * t[0][0] + t[0][1] * t[0][1]), 1e-9 * s.xx);
        assert_close(s.xy, 0.36 * (t[0][0] * t[1][0] + t[0][1] * t[1][1]), 1e-9 * (s.xx + s.yy));
        assert_close(s.det, 0.36 * 0.36 * det * det, 1e-9 * s.xx * s.yy);
    }
}

static trip_settings ewa_settings(void)
{
    trip_settings s = trip_settings_default();
    s.footprint = TRIP_FOOTPRINT_EWA;
    return s;
}

/* As splat.h states, S equals S of the exact footprint, and so do the numbers at the centre. */
static void parallel_views_and_splat_centres_are_exact(void **state)
{
    (void)state;
    int affine = 0;
    for (int i = 0; i < 300; i++) {
        trip_affine map = random_map(0.8);
        trip_camera c = camera_of(trip_v3(19, 3, 2), trip_v3(0, 0, 0), 50, i % 2 ? 30 : 0, &map);
        trip_settings settings = trip_settings_default(), by_ewa = ewa_settings();
        trip_splat_frame exact = trip_splat_frame_make(&c, &settings);
        trip_splat_frame frame = trip_splat_frame_make(&c, &by_ewa);
        trip_vec3 at = { 4 * test_random(), 4 * test_random(), 4 * test_random() };
        trip_splat a, b;
        assert_true(trip_splat_project(&exact, at, &a) && trip_splat_project(&frame, at, &b));
        if (a.near)
            continue;
        affine += b.affine;
        assert_true(b.affine || c.ortho);
        double stretch = b.affine ? 1 : trip_splat_stretch(&frame, a.x, a.y);
        assert_close(b.amplitude * stretch, a.amplitude * trip_splat_stretch(&exact, a.x, a.y),
                     1e-12);
        assert_close(b.conic_xx, a.conic_xx, 1e-9 * a.conic_xx);
        assert_close(b.conic_xy, a.conic_xy, 1e-9 * (a.conic_xx + a.conic_yy));
        assert_close(b.conic_yy, a.conic_yy, 1e-9 * a.conic_yy);
    }
    assert_in_range(affine, 100, 150);
}

/* Every ray of an affine support passes within its radius, and its pixels lie in its bounds. */
static void affine_supports_are_ellipses_within_their_radius(void **state)
{
    (void)state;
    int affine = 0, near = 0;
    for (int i = 0; i < 600; i++) {
        trip_affine map = random_map(0.8);
        trip_camera c = camera_of(trip_v3(8, 3, 2), trip_v3(0, 0, 0), 20 + i % 130, 0, &map);
        trip_settings by_ewa = ewa_settings();
        by_ewa.kernel_radius = i % 3 ? 2 : 0.7;
        trip_splat_frame f = trip_splat_frame_make(&c, &by_ewa);
        trip_vec3 ray = trip_camera_ray(&c, 200 * test_random(), 150 * test_random());
        trip_vec3 from_eye = trip_scale(ray, (1 + 20 * test_random()) / trip_length(ray));
        trip_splat s;
        if (!trip_splat_project(&f, trip_add(c.eye, from_eye), &s))
            continue;
        affine += s.affine;
        near += s.near;
        assert_true(s.affine != s.near);
        for (int k = 0; k < 40 && s.affine; k++) {
            double angle = k * PI / 20, dx = cos(angle), dy = sin(angle);
            double m = s.conic_xx * dx * dx + 2 * s.conic_xy * dx * dy + s.conic_yy * dy * dy;
            double x = s.x + dx * sqrt(f.cutoff2 / m), y = s.y + dy * sqrt(f.cutoff2 / m);
            assert_close(trip_splat_radius2(&f, &s, x, y), f.cutoff2, 1e-9);
            assert_true(x >= s.x0 - 1e-9 && x <= s.x1 + 1e-9);
            assert_true(y >= s.y0 - 1e-9 && y <= s.y1 + 1e-9);
            trip_vec3 r = trip_camera_ray(&c, x, y);
            double d = trip_length(trip_cross(from_eye, r)) / trip_length(r);
            assert_true(d <= s.radius * (1 + 1e-9));
        }
    }
    assert_in_range(affine, 100, 600);
    assert_in_range(near, 20, 600);
}

/* Every ray of a scaled flat support passes within its radius, and its pixels lie in its bounds.
 * These supports may be much larger than round ones. Rays of parallel views begin in the plane of
 * the eye. */
static void scaled_flat_supports_are_within_their_radius(void **state)
{
    (void)state;
    int larger = 0;
    for (int i = 0; i < 400; i++) {
        trip_affine map = random_map(0.8);
        double ortho = i % 4 ? 0 : 40;
        trip_camera c = camera_of(trip_v3(8, 3, 2), trip_v3(0, 0, 0), 20 + i % 90, ortho, &map);
        trip_settings settings = ewa_settings();
        settings.low_pass = TRIP_LOW_PASS_UNIFORM;
        settings.flatten = 3 + i % 60;
        trip_splat_frame f = trip_splat_frame_make(&c, &settings);
        double px = 200 * test_random(), py = 150 * test_random(), z = 5 + 400 * test_random();
        trip_vec3 begin =
            ortho > 0 ? trip_add(trip_scale(c.rx, px), trip_scale(c.ry, py)) : trip_v3(0, 0, 0);
        trip_vec3 from_eye = trip_add(begin, trip_scale(trip_camera_ray(&c, px, py), z));
        const double gradient[3] = { test_random() - 0.5, test_random() - 0.5,
                                     test_random() - 0.5 };
        trip_flattening flat = trip_splat_flattening(&f, gradient, 1e-3);
        trip_splat s;
        if (!trip_splat_project_flat(&f, trip_add(c.eye, from_eye), &flat, &s) || s.near)
            continue;
        for (int k = 0; k < 40; k++) {
            double dx = cos(k * PI / 20), dy = sin(k * PI / 20);
            double m = s.conic_xx * dx * dx + 2 * s.conic_xy * dx * dy + s.conic_yy * dy * dy;
            double x = s.x + dx * sqrt(f.cutoff2 / m), y = s.y + dy * sqrt(f.cutoff2 / m);
            trip_vec3 r = trip_camera_ray(&c, x, y), to = from_eye;
            if (ortho > 0)
                to = trip_sub(to, trip_add(trip_scale(c.rx, x), trip_scale(c.ry, y)));
            double d = trip_length(trip_cross(to, r)) / trip_length(r);
            assert_true(d <= s.radius * (1 + 1e-9));
            larger += d > 4 * settings.kernel_radius;
        }
    }
    assert_in_range(larger, 100, 16000);
}

/* A few scattered voxels. */
static bool scattered(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    *code = 65535;
    if (k == 2 && (i + 2 * j) % 5 == 0) {
        gradient[0] = 300 * cos(i);
        gradient[1] = 200 * sin(j);
        gradient[2] = -250;
        return true;
    }
    return false;
}

static trip_affine uneven_map(void)
{
    trip_affine m = trip_affine_identity();
    m.m[0][0] = 1.5;
    m.m[0][1] = 0.3;
    m.m[1][1] = 0.5;
    m.m[2][2] = 0.8;
    return m;
}

/* Returns the expected optical depth of a pixel: the sum of the voxels' Gaussians, by the formulas
 * of the paper. */
static double expected_depth(const trip_camera *c, const trip_settings *settings, double extinction,
                             double x, double y)
{
    double sigma = settings->kernel_radius / TRIP_CUTOFF, k2 = TRIP_CUTOFF * TRIP_CUTOFF, sum = 0;
    double edge = exp(-k2 / 2),
           low_pass = settings->low_pass == TRIP_LOW_PASS_NONE ? 0 : settings->low_pass_px;
    for (int i = 0; i < 9; i++)
        for (int j = 0; j < 9; j++) {
            if ((i + 2 * j) % 5 != 0)
                continue;
            trip_vec3 v = trip_sub(trip_v3(i, j, 2), c->eye);
            double z = trip_dot(c->forward, v), u = trip_dot(c->to_x, v) / z;
            double w = trip_dot(c->to_y, v) / z, length;
            trip_vec3 a = trip_scale(trip_sub(c->to_x, trip_scale(c->forward, u)), sigma / z);
            trip_vec3 b = trip_scale(trip_sub(c->to_y, trip_scale(c->forward, w)), sigma / z);
            double xx = trip_dot(a, a), yy = trip_dot(b, b), xy = trip_dot(a, b);
            double det = xx * yy - xy * xy;
            double wide = (xx + low_pass * low_pass) * (yy + low_pass * low_pass) - xy * xy;
            double dx = x - u, dy = y - w;
            double m = ((yy + low_pass * low_pass) * dx * dx - 2 * xy * dx * dy +
                        (xx + low_pass * low_pass) * dy * dy) /
                       wide;
            length = trip_length(trip_affine_vector(&c->index_to_world, v)) / trip_length(v);
            if (m <= k2)
                sum += extinction * length / (2 * PI * sigma * sigma) * sqrt(det / wide) *
                       (exp(-m / 2) - edge) / (1 - edge * (1 + k2 / 2));
        }
    return sum;
}

static void pictures_are_sums_of_gaussians(void **state)
{
    (void)state;
    trip_affine map = uneven_map();
    scene s;
    scene_create(&s,
                 &(scene_params){ .dims = { 9, 9, 4 }, .index_to_world = map, .voxel = scattered });
    s.table[65535] = (trip_tf_entry){ 1, 1, 1, 0.7f };
    for (int i = 0; i < 3; i++) {
        trip_settings settings = ewa_settings();
        settings.shading = false;
        settings.method = TRIP_METHOD_AXIS;
        settings.compositing = TRIP_COMPOSITING_SHEET;
        settings.background[3] = 0;
        settings.low_pass = i == 1 ? TRIP_LOW_PASS_NONE : TRIP_LOW_PASS_EWA;
        trip_camera_params view =
            scene_view(&s, trip_v3(0.3, 0.2, 1), i == 2 ? 200 : 20, 50, i == 2 ? 40 : 60);
        trip_camera c;
        assert_int_equal(trip_camera_make(&c, &view, &map), 0);
        scene_picture p = scene_draw(&s, scene_renderers(), &view, &settings);
        double max = 0;
        for (int y = 0; y < p.height; y++)
            for (int x = 0; x < p.width; x++) {
                double depth = expected_depth(&c, &settings, (double)0.7f, x + 0.5, y + 0.5);
                max = fmax(max, -expm1(-depth));
                assert_close((double)scene_pixel(&p, x, y)[3], -expm1(-depth), 1e-5);
            }
        assert_true(max > 0.01);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

/* Standard deviations. 0 switches the filter off. At 16 pixels no splat of the views is affine. */
static const double widths_px[] = { 0, 0.4, 1, 2.5, 16 };
enum { WIDTHS = sizeof widths_px / sizeof *widths_px };

static void filters_are_as_wide_as_the_setting(void **state)
{
    (void)state;
    trip_affine map = uneven_map();
    scene s;
    scene_create(&s,
                 &(scene_params){ .dims = { 9, 9, 4 }, .index_to_world = map, .voxel = scattered });
    s.table[65535] = (trip_tf_entry){ 1, 1, 1, 0.7f };
    trip_camera_params view = scene_view(&s, trip_v3(0.3, 0.2, 1), 60, 50, 60);
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &view, &map), 0);
    for (int i = 0; i < WIDTHS - 1; i++) {
        trip_settings settings = ewa_settings();
        settings.shading = false;
        settings.method = TRIP_METHOD_AXIS;
        settings.compositing = TRIP_COMPOSITING_SHEET;
        settings.background[3] = 0;
        settings.low_pass_px = widths_px[i];
        scene_turn turn = scene_turns(scene_renderers(), &s, &view, &settings);
        while (scene_take_turn(&turn))
            for (int y = 0; y < 60; y++)
                for (int x = 0; x < 60; x++) {
                    double depth = expected_depth(&c, &settings, (double)0.7f, x + 0.5, y + 0.5);
                    assert_close((double)scene_pixel(&turn.picture, x, y)[3], -expm1(-depth),
                                 fmax(1e-5, turn.renderer->tolerance));
                }
    }
    scene_destroy(&s);
}

/* Compares every renderer with the reference. */
static void compare(const scene *s, const trip_camera_params *view, const trip_settings *settings)
{
    scene_picture expected = scene_draw(s, scene_renderers(), view, settings);
    for (const scene_renderer *r = scene_renderers() + 1; r->name; r++) {
        scene_picture p = scene_draw(s, r, view, settings);
        double max = scene_difference(&expected, &p);
        if (!(max <= r->tolerance))
            fail_msg("%s: %.3f of 1/255, %.3f allowed", r->name, 255 * max, 255 * r->tolerance);
        for (int axis = 0; axis < 3 && settings->flatten <= 1; axis++)
            scene_compare_counts(&expected.lists[axis], &p.lists[axis], r->name);
        scene_picture_free(&p);
    }
    scene_picture_free(&expected);
}

/* Draws cubes and sheared voxels from outside, from inside, from far away and in parallel
 * projection. */
static void compare_views(double flatten)
{
    const trip_affine sheared = cpu_scenes_sheared();
    for (int grid = 0; grid < 2; grid++) {
        scene s;
        cpu_scenes_blobs(&s, 16, grid ? &sheared : NULL);
        for (int i = 0; i < 8; i++) {
            trip_settings settings = ewa_settings();
            settings.flatten = flatten;
            settings.compositing = i % 2 ? TRIP_COMPOSITING_SHEET : TRIP_COMPOSITING_SPLAT;
            settings.low_pass = i == 5 ? TRIP_LOW_PASS_NONE : TRIP_LOW_PASS_EWA;
            settings.shading = i != 6;
            double distance[4] = { 70, 4, 25, 900 };
            trip_camera_params view = scene_view(&s, trip_v3(1, 0.7 - 0.4 * i, 0.4),
                                                 distance[i % 4], i % 4 == 1 ? 110 : 50, 48);
            view.ortho_height = i == 7 ? 40 : 0;
            compare(&s, &view, &settings);
        }
        scene_destroy(&s);
    }
}

static void renderers_agree_with_the_reference(void **state)
{
    (void)state;
    compare_views(1);
}

static void renderers_agree_for_every_width_of_the_filter(void **state)
{
    (void)state;
    const trip_affine sheared = cpu_scenes_sheared();
    scene s;
    cpu_scenes_blobs(&s, 16, &sheared);
    for (int i = 0; i < 3 * WIDTHS; i++) {
        trip_settings settings = ewa_settings();
        settings.footprint = i % 2 ? TRIP_FOOTPRINT_EWA : TRIP_FOOTPRINT_EXACT;
        settings.low_pass_px = widths_px[i / 3];
        trip_camera_params view =
            scene_view(&s, trip_v3(1, 0.7 - 0.1 * i, 0.4), i % 3 == 1 ? 4 : 70, 60, 32);
        compare(&s, &view, &settings);
    }
    scene_destroy(&s);
}

static void renderers_flatten_like_the_reference(void **state)
{
    (void)state;
    compare_views(5);
}

static trip_settings flat_and_scaled(void)
{
    trip_settings settings = ewa_settings();
    settings.low_pass = TRIP_LOW_PASS_UNIFORM;
    settings.flatten = 100;
    settings.shading = false;
    settings.background[3] = 0;
    settings.method = TRIP_METHOD_AXIS;
    return settings;
}

/* With `clip`, the list of a pixel may differ from the list of the splat's centre. A splat that
 * reaches the pixel must not be left out because its centre has no weight. */
static void scaled_flat_splats_reach_across_borders_between_lists(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 16, NULL);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.8, 0.7), 80, 50, 48);
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &view, &s.data->index_to_world), 0);
    trip_settings settings = flat_and_scaled();
    scene_picture whole = scene_draw(&s, scene_renderers(), &view, &settings);
    settings.method = TRIP_METHOD_CLIP;
    scene_picture parts = scene_draw(&s, scene_renderers(), &view, &settings);
    int axis = trip_weight_axis_of_view(&c), own = 0;
    for (int i = 0; i < 48 * 48; i++) {
        trip_vec3 ray = trip_camera_ray(&c, i % 48 + 0.5, i / 48 + 0.5);
        if (!(trip_weight(&settings, axis, ray, axis) > 0))
            continue;
        own++;
        for (int k = 0; k < 4; k++)
            assert_close(parts.rgba[4 * i + k], whole.rgba[4 * i + k], 1e-6);
    }
    assert_in_range(own, 400, 48 * 48 - 400);
    scene_picture_free(&whole);
    scene_picture_free(&parts);
    scene_destroy(&s);
}

/* The picture is the centre of a larger picture. Objects seen edge-on lie along the rim. */
static void scaled_flat_splats_reach_in_from_outside_the_picture(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 16, NULL);
    trip_settings settings = flat_and_scaled();
    for (int i = 0; i < 6; i++) {
        const trip_vec3 aside = trip_scale(trip_v3(0.6, -0.8, 0), 7 * (i / 2));
        trip_camera_params view = scene_view(&s, trip_v3(0.8, 0.6, 0.7), 80, 10, 24);
        view.eye = trip_add(view.eye, aside);
        view.look = trip_add(view.look, aside);
        view.ortho_height = i % 2 ? 14 : 0;
        scene_picture small = scene_draw(&s, scene_renderers(), &view, &settings);
        view.width = view.height = 72;
        view.fov_degrees = 360 / PI * atan(3 * tan(5 * PI / 180));
        view.ortho_height *= 3;
        scene_picture large = scene_draw(&s, scene_renderers(), &view, &settings);
        for (int n = 0; n < 24 * 24; n++)
            for (int k = 0; k < 4; k++)
                assert_close(small.rgba[4 * n + k],
                             scene_pixel(&large, 24 + n % 24, 24 + n / 24)[k], 1e-5);
        scene_picture_free(&small);
        scene_picture_free(&large);
    }
    scene_destroy(&s);
}

static double conic_det(const trip_splat *s)
{
    return s->conic_xx * s->conic_yy - s->conic_xy * s->conic_xy;
}

/* Seen face-on, a flat kernel looks round. Seen edge-on, it is thin in one direction and has the
 * same mass. */
static void kernels_are_flattened_along_their_gradients(void **state)
{
    (void)state;
    trip_affine map = trip_affine_identity();
    trip_camera c = camera_of(trip_v3(4, 4, 60), trip_v3(4, 4, 2), 20, 0, &map);
    trip_settings settings = ewa_settings();
    settings.flatten = 10;
    settings.low_pass = TRIP_LOW_PASS_NONE;
    trip_splat_frame f = trip_splat_frame_make(&c, &settings);
    const double along[3] = { 0, 0, 7 }, across[3] = { 7, 0, 0 }, weak[3] = { 3.5, 0, 0 };
    trip_flattening flats[3] = { trip_splat_flattening(&f, along, 7),
                                 trip_splat_flattening(&f, across, 7),
                                 trip_splat_flattening(&f, weak, 7) };
    trip_splat round, s[3];
    assert_true(trip_splat_project(&f, trip_v3(4, 4, 2), &round));
    for (int i = 0; i < 3; i++)
        assert_true(trip_splat_project_flat(&f, trip_v3(4, 4, 2), &flats[i], &s[i]));
    assert_close(s[0].conic_xx, round.conic_xx, 1e-12);
    assert_close(s[0].amplitude, round.amplitude, 1e-12);
    assert_close(conic_det(&s[1]), 100 * conic_det(&round), 1e-9);
    assert_close(s[1].amplitude, 10 * round.amplitude, 1e-9);
    assert_close(conic_det(&s[2]), conic_det(&round) / (1 - 0.5 * 0.99), 1e-9);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_jacobian_of_a_unit_camera_is_the_papers),
        cmocka_unit_test(the_jacobian_is_the_derivative_of_ray_space),
        cmocka_unit_test(a_gaussian_stays_one_under_affine_maps),
        cmocka_unit_test(integrated_covariances_are_those_of_line_integrals),
        cmocka_unit_test(low_passed_covariances_are_those_of_convolutions),
        cmocka_unit_test(uniform_scaling_widens_the_shortest_axis_to_the_filter),
        cmocka_unit_test(flat_kernels_become_surface_kernels),
        cmocka_unit_test(parallel_views_and_splat_centres_are_exact),
        cmocka_unit_test(affine_supports_are_ellipses_within_their_radius),
        cmocka_unit_test(scaled_flat_supports_are_within_their_radius),
        cmocka_unit_test(pictures_are_sums_of_gaussians),
        cmocka_unit_test(filters_are_as_wide_as_the_setting),
        cmocka_unit_test(renderers_agree_with_the_reference),
        cmocka_unit_test(renderers_agree_for_every_width_of_the_filter),
        cmocka_unit_test(renderers_flatten_like_the_reference),
        cmocka_unit_test(scaled_flat_splats_reach_across_borders_between_lists),
        cmocka_unit_test(scaled_flat_splats_reach_in_from_outside_the_picture),
        cmocka_unit_test(kernels_are_flattened_along_their_gradients),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
