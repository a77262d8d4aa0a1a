/* Footprints and colours of Gaussians against closed forms. */
#include "gaussian_footprint.h"
#include "test.h"

#define PI 3.14159265358979323846

/* A camera at the origin that looks along z, with y up in the picture. Focal length: 100 px for a
 * picture of 200 px, since the angle is 90 degrees. */
static trip_camera camera_of(int width, double ortho_height)
{
    const trip_camera_params params = { .look = trip_v3(0, 0, 1),
                                        .up = trip_v3(0, 1, 0),
                                        .fov_degrees = 90,
                                        .ortho_height = ortho_height,
                                        .width = width,
                                        .height = 200 };
    const trip_affine identity = trip_affine_identity();
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &params, &identity), 0);
    return c;
}

static trip_gaussian round_at(double x, double y, double z, double deviation)
{
    const float d = (float)deviation;
    return (trip_gaussian){ .centre = { x, y, z },
                            .deviations = { d, d, d },
                            .rotation = { 1, 0, 0, 0 },
                            .opacity = 0.5f };
}

static const trip_gaussian_settings plain;

static trip_gaussian_footprint drawn(const trip_camera *c, const trip_gaussian_settings *s,
                                     const trip_gaussian *g)
{
    trip_gaussian_footprint f = { 0 };
    assert_true(trip_gaussian_footprint_of(c, s, g, &f));
    return f;
}

static bool is_drawn(const trip_camera *c, const trip_gaussian_settings *s, const trip_gaussian *g)
{
    trip_gaussian_footprint f;
    return trip_gaussian_footprint_of(c, s, g, &f);
}

/* Variances of the screen along x and y. */
static double variance_x(const trip_gaussian_footprint *f)
{
    return 1 / (f->across * f->across) + f->shear * f->shear / (f->down * f->down);
}

static double variance_y(const trip_gaussian_footprint *f)
{
    return 1 / (f->down * f->down);
}

static void a_centre_projects_to_its_pixel_position(void **state)
{
    (void)state;
    const trip_camera c = camera_of(200, 0);
    const trip_gaussian g = round_at(-1, 2, 10, 0.1); /* x to the left of z, as seen along z */
    const trip_gaussian_footprint f = drawn(&c, &plain, &g);
    assert_close(f.x, 100 + 10, 1e-12);
    assert_close(f.y, 100 - 20, 1e-12);
}

static void a_width_on_the_axis_is_the_projected_one_and_the_filter(void **state)
{
    (void)state;
    const trip_camera c = camera_of(200, 0);
    const trip_gaussian g = round_at(0, 0, 10, 0.5);
    const trip_gaussian_footprint f = drawn(&c, &plain, &g);
    assert_close(variance_x(&f), 5 * 5 + 0.3, 1e-6);
    assert_close(variance_y(&f), 5 * 5 + 0.3, 1e-6);
    /* alpha falls to 1/255 at the reach */
    assert_close(0.5 * exp(-0.5 * trip_gaussian_radius2(&f, f.reach_x, 0)), 1.0 / 255, 1e-6);
}

static void a_rotation_turns_the_footprint(void **state)
{
    (void)state;
    const trip_camera c = camera_of(200, 20); /* 10 px per unit */
    trip_gaussian g = round_at(0, 0, 10, 0);
    g.deviations[0] = 2;
    g.deviations[1] = 1;
    const double half = 15 * PI / 180; /* 30 degrees about z */
    g.rotation[0] = (float)cos(half);
    g.rotation[3] = (float)sin(half);
    const trip_gaussian_footprint f = drawn(&c, &plain, &g);
    /* Picture x is -x of the scene and picture y is -y. So the long axis has the direction (cos 30,
     * sin 30) in both. */
    const double along = sqrt(400.3), across = sqrt(100.3), x = cos(PI / 6), y = sin(PI / 6);
    assert_close(trip_gaussian_radius2(&f, along * x, along * y), 1, 1e-5);
    assert_close(trip_gaussian_radius2(&f, -across * y, across * x), 1, 1e-5);
}

/* Beyond 1.3 times the half angle, the Jacobian is the one at 1.3 times the half angle. */
static void a_jacobian_is_clamped_beyond_the_picture(void **state)
{
    (void)state;
    const trip_camera c =
        camera_of(400, 0); /* the tangent of half the angle is 2 along x, 1 along y */
    trip_gaussian g = round_at(-40, 0, 10, 0.5);
    trip_gaussian_footprint f = drawn(&c, &plain, &g);
    assert_close(f.x, 200 + 400, 1e-12); /* the centre itself is not clamped */
    assert_close(variance_x(&f), 25 * (1 + 2.6 * 2.6) + 0.3, 1e-6);
    assert_close(variance_y(&f), 25.3, 1e-6);
    g = round_at(0, -40, 10, 0.5);
    f = drawn(&c, &plain, &g);
    assert_close(variance_x(&f), 25.3, 1e-6);
    assert_close(variance_y(&f), 25 * (1 + 1.3 * 1.3) + 0.3, 1e-6);
    g = round_at(-25, 0, 10, 0.5); /* at 1.25 times the half angle it is exact */
    f = drawn(&c, &plain, &g);
    assert_close(variance_x(&f), 25 * (1 + 2.5 * 2.5) + 0.3, 1e-6);
}

static void a_parallel_view_has_one_width_everywhere(void **state)
{
    (void)state;
    const trip_camera c = camera_of(200, 20);
    const trip_gaussian near = round_at(0, 0, 0.01, 0.5), far = round_at(900, 0, 500, 0.5);
    const trip_gaussian_footprint a = drawn(&c, &plain, &near), b = drawn(&c, &plain, &far);
    assert_close(variance_x(&a), 25.3, 1e-6);
    assert_close(variance_x(&b), 25.3, 1e-6);
    assert_close(b.x, 100 - 9000, 1e-9);
}

static void antialiased_scenes_keep_the_mass_of_small_gaussians(void **state)
{
    (void)state;
    const trip_camera c = camera_of(200, 20);
    const trip_gaussian_settings s = { .antialiased = true };
    const trip_gaussian g = round_at(0, 0, 10, 0.05); /* 0.5 px */
    assert_close(drawn(&c, &s, &g).opacity, 0.5 * 0.25 / (0.25 + 0.3), 1e-6);
    const trip_gaussian point = round_at(0, 0, 10, 0);
    assert_false(is_drawn(&c, &s, &point)); /* 0.5 sqrt(0.000025) is below 1/255 */
    assert_close(drawn(&c, &plain, &point).opacity, 0.5, 1e-6);
}

static void an_opacity_scale_multiplies_the_optical_depth_at_the_centre(void **state)
{
    (void)state;
    const trip_camera c = camera_of(200, 0);
    trip_gaussian g = round_at(0, 0, 10, 0.5);
    assert_close(drawn(&c, &(trip_gaussian_settings){ .opacity_scale = 3 }, &g).opacity, 0.875,
                 1e-12);
    assert_close(drawn(&c, &(trip_gaussian_settings){ .opacity_scale = 1 }, &g).opacity, 0.5, 0);
    g.opacity = 1; /* as of surfels: drawing limits it to 0.99 */
    assert_close(drawn(&c, &(trip_gaussian_settings){ .opacity_scale = 0.5 }, &g).opacity, 0.9,
                 1e-12);
}

static void faint_near_and_clipped_gaussians_are_not_drawn(void **state)
{
    (void)state;
    const trip_camera c = camera_of(200, 0), parallel = camera_of(200, 20);
    trip_gaussian g = round_at(0, 0, 0.19, 0.5);
    assert_false(is_drawn(&c, &plain, &g));
    assert_true(is_drawn(&parallel, &plain, &g));
    g = round_at(0, 0, 0.21, 0.5);
    assert_true(is_drawn(&c, &plain, &g));
    g = round_at(0, 0, -1, 0.5);
    assert_false(is_drawn(&c, &plain, &g));
    assert_false(is_drawn(&parallel, &plain, &g));
    g = round_at(0, 0, 10, 0.5);
    g.opacity = 1 / 256.0f;
    assert_false(is_drawn(&c, &plain, &g));
    g.opacity = 1 / 254.0f;
    assert_true(is_drawn(&c, &plain, &g));
    trip_gaussian_settings s = { 0 };
    trip_clip_add(&s.clip, trip_v3(0, 0, 1), -9.99); /* z >= 9.99 */
    assert_true(is_drawn(&c, &s, &g));
    g.centre[2] = 9.98;
    assert_false(is_drawn(&c, &s, &g));
}

static void turn_about_y(trip_gaussian *g, double degrees)
{
    g->rotation[0] = (float)cos(degrees * PI / 360);
    g->rotation[2] = (float)sin(degrees * PI / 360);
}

static const trip_gaussian_settings exact = { .shape = TRIP_GAUSSIAN_EXACT };

/* A ray meets the plane of a flat Gaussian at a point, which lies some deviations from the centre.
 * The footprint is so large that the low-pass filter changes little. */
static void an_exact_flat_gaussian_is_where_rays_meet_its_plane(void **state)
{
    (void)state;
    const trip_camera c = camera_of(20000, 0); /* 100 px of focal length */
    trip_gaussian g = round_at(2, 1, 10, 0);
    g.deviations[0] = 4;
    g.deviations[1] = 3;
    g.opacity = 1;
    turn_about_y(&g, 40);
    const trip_gaussian_footprint f = drawn(&c, &exact, &g);
    const double cosine = cos(40 * PI / 180), sine = sin(40 * PI / 180);
    /* Picture x is -x of the scene and picture y is -y. Axis 0 is (cos, 0, -sin), the normal (sin,
     * 0, cos). */
    int met = 0;
    for (double dx = -150; dx <= 150; dx += 25)
        for (double dy = -100; dy <= 100; dy += 25) {
            const double x = -(f.x + dx - 10000) / 100, y = -(f.y + dy - 100) / 100;
            const double t = (2 * sine + 10 * cosine) / (x * sine + cosine);
            const double u = (t * x - 2) * cosine - (t - 10) * sine, v = t * y - 1;
            if (t <= 0)
                continue;
            met++;
            assert_close(trip_gaussian_radius2(&f, dx, dy), u * u / 16 + v * v / 9, 3e-3);
        }
    assert_true(met > 60);
}

static void an_ewa_footprint_is_not_limited_and_keeps_its_mass(void **state)
{
    (void)state;
    const trip_camera c = camera_of(200, 0);
    const trip_gaussian_settings ewa = { .shape = TRIP_GAUSSIAN_EWA };
    const trip_gaussian g = round_at(-40, 0, 10, 0.05); /* at 4 times the half angle */
    const trip_gaussian_footprint f = drawn(&c, &ewa, &g);
    assert_close(variance_x(&f), 0.25 * 17 + 0.3, 1e-6);
    assert_close(variance_y(&f), 0.25 + 0.3, 1e-6);
    assert_close(f.opacity, 0.5 * sqrt(4.25 * 0.25 / (4.55 * 0.55)), 1e-6);
}

/* Along a ray, the squared distance in deviations has its minimum q. The minimum is found by small
 * steps. */
static void an_exact_gaussian_is_the_minimum_along_the_ray(void **state)
{
    (void)state;
    const trip_camera c = camera_of(20000, 0);
    trip_gaussian g = round_at(3, -1, 10, 0);
    g.deviations[0] = 1;
    g.deviations[1] = 2;
    g.deviations[2] = 3;
    g.opacity = 1;
    turn_about_y(&g, 25);
    const trip_gaussian_footprint f = drawn(&c, &exact, &g);
    for (double dx = -60; dx <= 60; dx += 20)
        for (double dy = -60; dy <= 60; dy += 20) {
            const double x = -(f.x + dx - 10000) / 100, y = -(f.y + dy - 100) / 100;
            double min = INFINITY;
            for (double t = 0; t < 40; t += 0.002) {
                const trip_vec3 to =
                    trip_gaussian_to_axes(&g, trip_v3(t * x - 3, t * y + 1, t - 10));
                min = fmin(min, to.x * to.x + to.y * to.y / 4 + to.z * to.z / 9);
            }
            assert_close(trip_gaussian_radius2(&f, dx, dy), min, 3e-3);
            assert_true(min > f.limit || (f.x + dx >= f.lo[0] && f.x + dx <= f.hi[0] &&
                                          f.y + dy >= f.lo[1] && f.y + dy <= f.hi[1]));
        }
}

/* At the bounds, the least q of a line is the limit. */
static void bounds_of_an_exact_gaussian_are_tight(void **state)
{
    (void)state;
    const trip_camera c = camera_of(400, 0);
    trip_gaussian g = round_at(4, 2, 8, 0);
    g.deviations[0] = 0.5f;
    g.deviations[1] = 1;
    g.deviations[2] = 1.5f;
    turn_about_y(&g, -30);
    const trip_gaussian_footprint f = drawn(&c, &exact, &g);
    double left = INFINITY, bottom = INFINITY;
    for (double t = f.lo[0]; t <= f.hi[0]; t += 0.01)
        bottom = fmin(bottom, trip_gaussian_radius2(&f, t - f.x, f.hi[1] - f.y));
    for (double t = f.lo[1]; t <= f.hi[1]; t += 0.01)
        left = fmin(left, trip_gaussian_radius2(&f, f.lo[0] - f.x, t - f.y));
    assert_close(left, f.limit, 1e-4);
    assert_close(bottom, f.limit, 1e-4);
}

static void unusable_numbers_draw_nothing(void **state)
{
    (void)state;
    const trip_camera c = camera_of(200, 0);
    const float bad[] = { NAN, INFINITY, 1e30f };
    for (int i = 0; i < 3; i++) {
        trip_gaussian g = round_at(0, 0, 10, 1);
        g.deviations[1] = bad[i];
        assert_false(is_drawn(&c, &plain, &g));
        g = round_at((double)bad[i], 0, 10, 1);
        assert_false(is_drawn(&c, &plain, &g));
        g = round_at(0, 0, 10, 1);
        g.opacity = i == 2 ? -1 : bad[i];
        assert_false(is_drawn(&c, &plain, &g));
        g = round_at(0, 0, 10, 1);
        g.rotation[2] = bad[i];
        assert_false(is_drawn(&c, &plain, &g));
    }
}

/* The integral over the sphere of the product of two harmonics is 1 if they are equal, else 0. */
static void harmonics_are_orthonormal(void **state)
{
    (void)state;
    enum { STEPS = 400 };
    double sums[TRIP_SH_MAX][TRIP_SH_MAX] = { { 0 } };
    for (int i = 0; i < STEPS; i++)
        for (int j = 0; j < 16; j++) {
            const double z = (2 * i + 1.0) / STEPS - 1, r = sqrt(1 - z * z), a = 2 * PI * j / 16;
            double basis[TRIP_SH_MAX];
            trip_sh_basis(3, trip_v3(r * cos(a), r * sin(a), z), basis);
            for (int m = 0; m < TRIP_SH_MAX; m++)
                for (int n = 0; n < TRIP_SH_MAX; n++)
                    sums[m][n] += basis[m] * basis[n] * 4 * PI / (STEPS * 16);
        }
    for (int m = 0; m < TRIP_SH_MAX; m++)
        for (int n = 0; n < TRIP_SH_MAX; n++)
            assert_close(sums[m][n], m == n ? 1 : 0, 1e-4);
}

/* The signs of the trainers: (-1)^m times cos(m a) or sin(|m| a), which are positive here. */
static void harmonics_have_the_trainers_signs(void **state)
{
    (void)state;
    double basis[TRIP_SH_MAX];
    /* An angle of 20 degrees about z, and 0.9 of the way up: all Legendre factors are positive. */
    const double a = 20 * PI / 180, z = 0.9, r = sqrt(1 - z * z);
    trip_sh_basis(3, trip_v3(r * cos(a), r * sin(a), z), basis);
    for (int l = 0, i = 0; l <= 3; l++)
        for (int m = -l; m <= l; m++, i++)
            assert_true(m % 2 ? basis[i] < 0 : basis[i] > 0);
    trip_sh_basis(1, trip_v3(0, 0, -1), basis);
    assert_close(basis[0], sqrt(1 / (4 * PI)), 1e-15);
    assert_close(basis[2], -sqrt(3 / (4 * PI)), 1e-15);
}

static void a_colour_is_a_half_plus_harmonics_and_not_negative(void **state)
{
    (void)state;
    trip_gaussian g = { 0 };
    double rgb[3];
    g.sh[0][0] = (float)sqrt(4 * PI);     /* adds 1 */
    g.sh[3][1] = (float)sqrt(4 * PI / 3); /* adds -x */
    g.sh[9][2] = 100;                     /* of degree 3 */
    trip_gaussian_colour(&g, 1, trip_v3(0.25, sqrt(1 - 0.0625), 0), rgb);
    assert_close(rgb[0], 1.5, 1e-6);
    assert_close(rgb[1], 0.25, 1e-6);
    assert_close(rgb[2], 0.5, 1e-12);
    trip_gaussian_colour(&g, 1, trip_v3(1, 0, 0), rgb);
    assert_close(rgb[1], 0, 0);
}

static void a_colour_belongs_to_the_direction_from_the_eye(void **state)
{
    (void)state;
    const trip_camera c = camera_of(200, 0), parallel = camera_of(200, 20);
    const trip_gaussian g = round_at(3, 0, 4, 1);
    const trip_vec3 d = trip_gaussian_direction(&c, &g), p = trip_gaussian_direction(&parallel, &g);
    assert_close(d.x, 0.6, 1e-12);
    assert_close(d.z, 0.8, 1e-12);
    assert_close(p.x, 0, 1e-12);
    assert_close(p.z, 1, 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_centre_projects_to_its_pixel_position),
        cmocka_unit_test(a_width_on_the_axis_is_the_projected_one_and_the_filter),
        cmocka_unit_test(a_rotation_turns_the_footprint),
        cmocka_unit_test(a_jacobian_is_clamped_beyond_the_picture),
        cmocka_unit_test(a_parallel_view_has_one_width_everywhere),
        cmocka_unit_test(antialiased_scenes_keep_the_mass_of_small_gaussians),
        cmocka_unit_test(an_opacity_scale_multiplies_the_optical_depth_at_the_centre),
        cmocka_unit_test(faint_near_and_clipped_gaussians_are_not_drawn),
        cmocka_unit_test(an_exact_flat_gaussian_is_where_rays_meet_its_plane),
        cmocka_unit_test(an_ewa_footprint_is_not_limited_and_keeps_its_mass),
        cmocka_unit_test(an_exact_gaussian_is_the_minimum_along_the_ray),
        cmocka_unit_test(bounds_of_an_exact_gaussian_are_tight),
        cmocka_unit_test(unusable_numbers_draw_nothing),
        cmocka_unit_test(harmonics_are_orthonormal),
        cmocka_unit_test(harmonics_have_the_trainers_signs),
        cmocka_unit_test(a_colour_is_a_half_plus_harmonics_and_not_negative),
        cmocka_unit_test(a_colour_belongs_to_the_direction_from_the_eye),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
