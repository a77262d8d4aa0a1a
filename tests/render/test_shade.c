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

/* Returns the grey of a splat at the origin with colour 0.5 and gradient_full 2. */
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
    /* The normal is half-way between the light and the eye. */
    double matt = 0.5 * (TRIP_AMBIENT + TRIP_DIFFUSE * sqrt(0.5));
    assert_close(lit(&s, 7, 0, 7), matt + TRIP_SPECULAR, 1e-12);
}

static void a_light_at_a_position_shines_from_there(void **state)
{
    (void)state;
    trip_settings s = trip_settings_default();
    s.headlight = false;
    s.point_light = true;
    s.light_position = trip_v3(5, 0, 0);
    assert_close(lit(&s, 9, 0, 0), 0.5 * (TRIP_AMBIENT + TRIP_DIFFUSE), 1e-12);
    s.light_position = trip_v3(0, 3, -4);
    assert_close(lit(&s, 0, 9, 0), 0.5 * (TRIP_AMBIENT + 0.6 * TRIP_DIFFUSE), 1e-12);
    s.light_position = trip_v3(0, 0, 0);
    assert_close(lit(&s, 0, 9, 0), 0.5 * TRIP_AMBIENT, 1e-12);
}

/* Normals of a sphere at an angle from the eye, in the plane of eye and light. `light` is the
 * angle between eye and light in degrees. */
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

/* The light shines from +x, and gradient_full is 2. */
static unsigned form_of(double gx, double gz, double grey)
{
    trip_settings s = trip_settings_default();
    trip_camera c = camera(false);
    s.headlight = false;
    s.light_direction = trip_v3(1, 0, 0);
    const trip_light light = trip_light_at(&s, &c, 2, trip_v3(0, 0, 0));
    const double gradient[3] = { gx, 0, gz };
    double rgb[3] = { grey, grey, grey };
    return trip_light_colour(&light, gradient, rgb);
}

static void colours_by_another_formula_have_another_number(void **state)
{
    (void)state;
    assert_int_equal(form_of(5, 1, 0.5), form_of(4, 1.5, 0.5));
    assert_int_not_equal(form_of(5, 1, 0.5), form_of(1, 0.2, 0.5)); /* below full strength */
    assert_int_not_equal(form_of(5, 1, 0.5), form_of(-5, 1, 0.5));  /* lit from behind */
    assert_int_not_equal(form_of(6, 5, 0.5), form_of(6, 5, 1));     /* at full brightness */
    assert_int_not_equal(form_of(0, 0, 0.5), form_of(1, 0.2, 0.5)); /* flat */
}

static void a_light_farther_than_can_be_computed_with_is_refused(void **state)
{
    (void)state;
    const trip_affine m = trip_affine_identity();
    trip_settings s = trip_settings_default();
    s.headlight = false;
    s.point_light = true;
    s.light_position = trip_v3(0, 0.99 * TRIP_LIGHT_FARTHEST_VOXELS, 0);
    assert_int_equal(trip_light_check(&s, &m), 0);
    test_catch_reports();
    s.light_position = trip_v3(0, -1.01 * TRIP_LIGHT_FARTHEST_VOXELS, 0);
    assert_int_equal(trip_light_check(&s, &m), TRIP_USAGE);
    assert_int_equal(test_caught_reports(), 1);
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

/* Computes the shading of shade.h for a grey. Gradients are in units of the gradient of full
 * shading. */
static double shaded(trip_vec3 g, trip_vec3 light, trip_vec3 eye, double grey)
{
    double length = trip_length(g), strength = fmin(1, length);
    if (length == 0)
        return grey;
    trip_vec3 n = trip_scale(g, 1 / length), half = trip_normalize(trip_add(light, eye));
    double facing = fmin(1, fmax(0, 4 * trip_dot(n, light) * trip_dot(n, eye)));
    double matt = grey * (1 + strength * (0.3 + 0.7 * fabs(trip_dot(n, light)) - 1));
    double shine = 0.2 * facing * pow(fabs(trip_dot(n, half)), 24);
    return fmin(1, fmax(0, matt + strength * shine));
}

typedef struct rounding {
    bool compact;
    trip_compact_normals how;
    double worst, sum; /* in 1/255, for the worst of some greys */
    long count;
} rounding;

static trip_vec3 kept(const rounding *r, trip_vec3 g)
{
    const double gradient[3] = { g.x, g.y, g.z };
    double back[3];
    if (r->compact)
        trip_compact_normal_unpack(&r->how, trip_compact_normal_pack(&r->how, gradient), back);
    else
        trip_normal_unpack(trip_normal_pack(gradient, 1), 1, back);
    return trip_v3(back[0], back[1], back[2]);
}

static double error_of(trip_vec3 g, trip_vec3 back, trip_vec3 light, trip_vec3 eye)
{
    double worst = 0;
    for (int grey = 0; grey <= 4; grey++)
        worst = fmax(worst, 255 * fabs(shaded(g, light, eye, grey / 4.0) -
                                       shaded(back, light, eye, grey / 4.0)));
    return worst;
}

/* Moves light and eye towards larger errors, as long as the error may exceed `max`. Returns the
 * largest error found. */
static double worst_about(trip_vec3 g, trip_vec3 back, trip_vec3 light, trip_vec3 eye,
                          bool headlight, double max, uint64_t *random)
{
    double error = error_of(g, back, light, eye), reach = 0.2;
    for (int step = 0; step < 60 && error > 0.6 * max; step++, reach *= 0.93) {
        trip_vec3 e = trip_normalize(trip_add(eye, trip_scale(random_direction(random), reach)));
        trip_vec3 l = trip_normalize(trip_add(light, trip_scale(random_direction(random), reach)));
        l = headlight ? e : l;
        double other = error_of(g, back, l, e);
        if (other > error) {
            error = other;
            light = l;
            eye = e;
        }
    }
    return error;
}

/* Tries gradients in all directions. Lengths go up to `longest`, half of them near that end. */
static void try_gradients(rounding *r, double shortest, double longest, int count)
{
    uint64_t random = 1;
    for (int i = 0; i < count; i++) {
        double part = 0.5 * (random_coordinate(&random) + 1);
        double length = shortest + (longest - shortest) * (i & 2 ? part : cbrt(part));
        trip_vec3 g = trip_scale(random_direction(&random), length),
                  eye = random_direction(&random);
        trip_vec3 light = i & 1 ? eye : random_direction(&random), back = kept(r, g);
        r->sum += error_of(g, back, light, eye);
        r->count++;
        r->worst = fmax(r->worst, worst_about(g, back, light, eye, i & 1, r->worst, &random));
    }
    print_message("%s of %g to %g: worst %.3f/255, mean %.3f/255\n",
                  r->compact ? "3 bytes" : "4 bytes", shortest, longest, r->worst,
                  r->sum / (double)r->count);
}

static void four_bytes_change_no_colour_by_half_a_step(void **state)
{
    (void)state;
    rounding weak = { 0 }, strong = { 0 };
    try_gradients(&weak, 0, 1, 1000000);
    try_gradients(&strong, 1, 4, 300000);
    assert_true(weak.worst < 0.5 && weak.sum / (double)weak.count < 0.1);
    assert_true(strong.worst < 0.5 && strong.sum / (double)strong.count < 0.1);
}

static rounding compact(double unit)
{
    const trip_affine m = trip_affine_identity();
    double step[3];
    trip_compact_normals_choose(&m, 1, unit, step);
    return (rounding){ .compact = true, .how = trip_compact_normals_make(&m, 1, step) };
}

static void three_bytes_of_a_strong_gradient_change_no_colour_by_half_a_step(void **state)
{
    (void)state;
    rounding r = compact(0);
    try_gradients(&r, 1.0001, 4, 300000);
    assert_true(r.worst < 0.5 && r.sum / (double)r.count < 0.1);
}

/* Values here have no smallest difference. */
static void three_bytes_of_any_gradient_change_a_colour_by_less_than_three_steps(void **state)
{
    (void)state;
    rounding r = compact(0);
    try_gradients(&r, 0, 1, 300000);
    assert_true(r.worst < 3 && r.worst > 0.5 && r.sum / (double)r.count < 0.4);
}

/* Gradients are multiples of 1/2 and shading is full at 10.2, as in volumes of 8 bits. */
static void three_bytes_of_bytes_change_no_colour(void **state)
{
    (void)state;
    const double unit = 0.5 / 10.2;
    rounding r = compact(unit);
    double worst = 0;
    for (int z = -20; z <= 20; z++)
        for (int y = -20; y <= 20; y++)
            for (int x = -20; x <= 20; x++) {
                trip_vec3 g = trip_v3(x * unit, y * unit, z * unit), light = { 0.6, 0, 0.8 };
                if (trip_length(g) < 1)
                    worst = fmax(worst, error_of(g, kept(&r, g), light, trip_v3(0, 0.6, 0.8)));
            }
    assert_true(worst < 1e-9);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flat_regions_keep_their_colour),
        cmocka_unit_test(a_surface_facing_the_headlight_is_brightest_on_either_side),
        cmocka_unit_test(at_the_silhouette_only_ambient_light_is_left),
        cmocka_unit_test(weak_gradients_are_shaded_in_proportion),
        cmocka_unit_test(a_given_light_shines_from_its_direction),
        cmocka_unit_test(a_light_at_a_position_shines_from_there),
        cmocka_unit_test(a_sphere_shines_on_the_side_that_light_and_eye_share),
        cmocka_unit_test(the_result_stays_within_the_colours_range),
        cmocka_unit_test(a_parallel_view_is_lit_alike_everywhere),
        cmocka_unit_test(colours_by_another_formula_have_another_number),
        cmocka_unit_test(a_light_farther_than_can_be_computed_with_is_refused),
        cmocka_unit_test(four_bytes_change_no_colour_by_half_a_step),
        cmocka_unit_test(three_bytes_of_a_strong_gradient_change_no_colour_by_half_a_step),
        cmocka_unit_test(three_bytes_of_bytes_change_no_colour),
        cmocka_unit_test(three_bytes_of_any_gradient_change_a_colour_by_less_than_three_steps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
