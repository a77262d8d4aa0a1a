#include "test.h"

#include "normal.h"
#include "shade.h"

static trip_camera camera(bool ortho)
{
    trip_camera_params p = { .eye = { 0, 0, 10 },
                             .up = { 0, 1, 0 },
                             .fov_degrees = 90,
                             .ortho_height = ortho ? 5 : 0,
                             .width = 10,
                             .height = 10 };
    trip_affine m = trip_affine_identity();
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &p, &m), 0);
    return c;
}

/* The grey of a splat at the origin of colour 0.5, gradient_full 2. */
static double lit(const trip_settings *s, double gx, double gy, double gz)
{
    trip_camera c = camera(false);
    double gradient[3] = { gx, gy, gz }, rgb[3] = { 0.5, 0.5, 0.5 };
    trip_shade(s, &c, 2, trip_v3(0, 0, 0), gradient, rgb);
    assert_close(rgb[0], rgb[1], 0);
    assert_close(rgb[0], rgb[2], 0);
    return rgb[0];
}

static void flat_regions_keep_their_colour(void **state)
{
    (void)state;
    trip_settings s = trip_settings_default();
    assert_close(lit(&s, 0, 0, 0), 0.5, 0);
}

static void a_surface_facing_the_headlight_is_brightest_on_either_side(void **state)
{
    (void)state;
    trip_settings s = trip_settings_default();
    double full = 0.5 * (TRIP_AMBIENT + TRIP_DIFFUSE) + TRIP_SPECULAR;
    assert_close(lit(&s, 0, 0, 5), full, 1e-12);
    assert_close(lit(&s, 0, 0, -2), full, 1e-12);
}

static void at_the_silhouette_only_ambient_light_is_left(void **state)
{
    (void)state;
    trip_settings s = trip_settings_default();
    assert_close(lit(&s, 3, -4, 0), 0.5 * TRIP_AMBIENT, 1e-12);
}

static void weak_gradients_are_shaded_in_proportion(void **state)
{
    (void)state;
    trip_settings s = trip_settings_default();
    assert_close(lit(&s, 1, 0, 0), 0.5 * (1 + 0.5 * (TRIP_AMBIENT - 1)), 1e-12);
}

static void a_given_light_shines_from_its_direction(void **state)
{
    (void)state;
    trip_settings s = trip_settings_default();
    s.headlight = false;
    s.light_direction = trip_v3(1, 0, 0);
    assert_close(lit(&s, 9, 0, 0), 0.5 * (TRIP_AMBIENT + TRIP_DIFFUSE), 1e-12);
    assert_close(lit(&s, 0, 7, 0), 0.5 * TRIP_AMBIENT, 1e-12);
    /* Half way between the light and the eye. */
    double matt = 0.5 * (TRIP_AMBIENT + TRIP_DIFFUSE * sqrt(0.5));
    assert_close(lit(&s, 7, 0, 7), matt + TRIP_SPECULAR, 1e-12);
}

/* Normals of a sphere at an angle from the eye in the plane of eye and light, these `light` degrees
 * apart. */
static void a_sphere_shines_on_the_side_that_light_and_eye_share(void **state)
{
    (void)state;
    const double degree = 3.14159265358979323846 / 180;
    trip_settings s = trip_settings_default();
    s.headlight = false;
    for (int light = 0; light < 180; light += 10) {
        s.light_direction = trip_v3(sin(light * degree), 0, cos(light * degree));
        for (int angle = -90; angle <= 90; angle += 3) {
            double to_eye = cos(angle * degree), to_light = cos((angle - light) * degree);
            double matt = 0.5 * (TRIP_AMBIENT + TRIP_DIFFUSE * fabs(to_light));
            double shine = TRIP_SPECULAR * pow(cos((angle - 0.5 * light) * degree), TRIP_SHININESS);
            double rgb = lit(&s, 9 * sin(angle * degree), 0, 9 * to_eye);
            assert_close(lit(&s, -9 * sin(angle * degree), 0, -9 * to_eye), rgb, 1e-12);
            if (to_light <= 0)
                assert_close(rgb, matt, 1e-12);
            else if (to_light * to_eye >= 0.25)
                assert_close(rgb, matt + shine, 1e-12);
            else
                assert_close(rgb, matt + shine * 4 * to_light * to_eye, 1e-12);
        }
    }
}

static void the_result_stays_within_the_colours_range(void **state)
{
    (void)state;
    trip_settings s = trip_settings_default();
    trip_camera c = camera(false);
    double gradient[3] = { 0, 0, 9 }, rgb[3] = { 1, 0, 1 };
    trip_shade(&s, &c, 2, trip_v3(0, 0, 0), gradient, rgb);
    assert_close(rgb[0], 1, 0);
    assert_close(rgb[1], TRIP_SPECULAR, 1e-12);
}

static void a_parallel_view_is_lit_alike_everywhere(void **state)
{
    (void)state;
    trip_settings s = trip_settings_default();
    trip_camera c = camera(true);
    for (int i = 0; i < 3; i++) {
        double gradient[3] = { 0, 0, 9 }, rgb[3] = { 0.5, 0.5, 0.5 };
        trip_shade(&s, &c, 2, trip_v3(2 * i, -i, 1), gradient, rgb);
        assert_close(rgb[0], 0.5 * (TRIP_AMBIENT + TRIP_DIFFUSE) + TRIP_SPECULAR, 1e-12);
    }
}

static double random_coordinate(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*state >> 11) * 0x1p-52 - 1;
}

static trip_vec3 random_direction(uint64_t *state)
{
    trip_vec3 v;
    do
        v = trip_v3(random_coordinate(state), random_coordinate(state), random_coordinate(state));
    while (trip_length(v) > 1 || trip_length(v) == 0);
    return trip_normalize(v);
}

/* Of 3 bytes of a gradient in units of `full`, in 1/255: of a white and of a dark splat. */
static double colour_error(const trip_compact_normals *c, const trip_settings *s, trip_vec3 g)
{
    trip_camera view = camera(false);
    double exact[3] = { g.x, g.y, g.z }, kept[3], worst = 0;
    trip_compact_normal_unpack(c, trip_compact_normal_pack(c, exact), kept);
    for (int dark = 0; dark < 2; dark++) {
        double a[3] = { dark ? 0.1 : 1 }, b[3] = { a[0] };
        trip_shade(s, &view, c->full, trip_v3(0, 0, 0), exact, a);
        trip_shade(s, &view, c->full, trip_v3(0, 0, 0), kept, b);
        worst = fmax(worst, 255 * fabs(a[0] - b[0]));
    }
    return worst;
}

static void three_bytes_of_a_strong_gradient_change_no_colour_by_half_a_step(void **state)
{
    (void)state;
    trip_settings s = trip_settings_default();
    trip_affine m = trip_affine_identity();
    trip_compact_normals c = trip_compact_normals_make(&m, 1, (const double[]){ 1, 1, 1 });
    uint64_t random = 1;
    double worst = 0;
    for (int i = 0; i < 1000000; i++) {
        s.headlight = i % 2;
        s.light_direction = random_direction(&random);
        worst = fmax(worst, colour_error(&c, &s, trip_scale(random_direction(&random), 1.5)));
    }
    assert_true(worst < 0.5);
}

/* Where values have no smallest difference. */
static void three_bytes_of_any_gradient_change_a_colour_by_less_than_three_steps(void **state)
{
    (void)state;
    trip_settings s = trip_settings_default();
    trip_affine m = trip_affine_identity();
    double step[3];
    trip_compact_normals_choose(&m, 1, 0, step);
    trip_compact_normals c = trip_compact_normals_make(&m, 1, step);
    uint64_t random = 2;
    double worst = 0, sum = 0;
    const int count = 1000000;
    for (int i = 0; i < count; i++) {
        s.headlight = i % 2;
        s.light_direction = random_direction(&random);
        double length = 0.5 * (random_coordinate(&random) + 1);
        double error = colour_error(&c, &s, trip_scale(random_direction(&random), length));
        worst = fmax(worst, error);
        sum += error;
    }
    assert_true(worst < 3 && sum / count < 0.4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flat_regions_keep_their_colour),
        cmocka_unit_test(a_surface_facing_the_headlight_is_brightest_on_either_side),
        cmocka_unit_test(at_the_silhouette_only_ambient_light_is_left),
        cmocka_unit_test(weak_gradients_are_shaded_in_proportion),
        cmocka_unit_test(a_given_light_shines_from_its_direction),
        cmocka_unit_test(a_sphere_shines_on_the_side_that_light_and_eye_share),
        cmocka_unit_test(the_result_stays_within_the_colours_range),
        cmocka_unit_test(a_parallel_view_is_lit_alike_everywhere),
        cmocka_unit_test(three_bytes_of_a_strong_gradient_change_no_colour_by_half_a_step),
        cmocka_unit_test(three_bytes_of_any_gradient_change_a_colour_by_less_than_three_steps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
