/* Compares the integral with closed forms computed here from the geometry alone, and the
 * reference's splats with the integral. */
#include "scenes.h"
#include "test.h"

#include "field.h"
#include "shade.h"
#include "splat.h"

#include <string.h>

enum { EDGE = 20 }; /* voxels of most volumes; EDGE - 1 between the outermost centres */

static scene_picture integrate(const scene *s, const trip_camera_params *view,
                               const trip_settings *settings)
{
    return scene_integrate(s, view, settings, &(scene_making){ 0 });
}

static trip_settings exact(double tolerance)
{
    trip_settings s = trip_settings_default();
    s.shading = false;
    s.tolerance = tolerance;
    s.background[3] = 0;
    return s;
}

static void a_constant_body_has_the_opacity_of_the_path_in_it(void **state)
{
    (void)state;
    const trip_vec3 directions[] = { { 1, 0, 0 }, { 0, 0, -1 }, { 0.3, 0.5, 0.2 }, { -1, 2, 0.7 } };
    for (int i = 0; i < 16; i++) {
        scene s;
        int crossed = 0;
        scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                          .index_to_world =
                                              i % 2 ? scene_sheared : trip_affine_identity() });
        for (int code = 0; code < 65536; code++)
            s.table[code] = (trip_tf_entry){ 1, 0.5F, 0.25F, 0.05F };
        trip_camera_params view = scene_view(&s, directions[i / 4], 60, 40, 9);
        view.ortho_height = i / 2 % 2 ? 25 : 0;
        trip_settings settings = exact(1e-6);
        settings.kernel = (trip_kernel)(i % 3 == 0);
        scene_picture p = integrate(&s, &view, &settings);
        for (int n = 0; n < 81; n++) {
            trip_vec3 o, d;
            double from, to, alpha = 0;
            scene_ray(&s, &view, n % 9, n / 9, &o, &d);
            if (scene_ray_in_grid(&s, o, d, &from, &to))
                alpha = 1 - exp(-0.05F * (to - from) * scene_ray_stretch(&s, d));
            crossed += alpha > 0;
            const float *c = scene_pixel(&p, n % 9, n / 9);
            assert_close(c[3], alpha, 1e-6);
            assert_close(c[0], alpha, 1e-6);
            assert_close(c[1], alpha / 2, 1e-6);
            assert_close(c[2], alpha / 4, 1e-6);
        }
        assert_in_range(crossed, 5, 81);
        scene_picture_free(&p);
        scene_destroy(&s);
    }
}

/* Codes rise by 3000 per voxel along i. */
static bool ramp(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)j;
    (void)k;
    (void)gradient;
    *code = 3000u * (unsigned)i;
    return true;
}

static void a_ramp_is_integrated_in_extinction_and_in_colour(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = ramp });
    for (int i = 0; i < 12; i++) {
        /* First both are linear in the value, then the colour alone. */
        bool both = i % 2;
        for (int code = 0; code < 65536; code++)
            s.table[code] = (trip_tf_entry){ both ? 1 : (float)code / 65535, 0, 0,
                                             both ? 0.4F * (float)code / 65535 : 0.11F };
        trip_camera_params view =
            scene_view(&s, trip_v3(i / 2 - 2.5, 0.4, 0.3 * (i % 3)), 60, 20, 7);
        const trip_settings settings = exact(1e-6);
        scene_picture p = integrate(&s, &view, &settings);
        for (int n = 0; n < 49; n++) {
            trip_vec3 o, d;
            double from, to;
            const float *c = scene_pixel(&p, n % 7, n / 7);
            scene_ray(&s, &view, n % 7, n / 7, &o, &d);
            if (!scene_ray_in_grid(&s, o, d, &from, &to))
                continue;
            double length = to - from, value = 3000 * (o.x + from * d.x) / 65535,
                   rise = 3000 * d.x / 65535, k = 0.11F, through = exp(-k * length);
            if (both)
                through = exp(-0.4 * (value + rise * length / 2) * length);
            assert_close(c[3], 1 - through, 1e-6);
            /* The integral of (value + rise t) k exp(-k t). */
            double red = value * (1 - through) + rise * ((1 - through) / k - length * through);
            assert_close(c[0], both ? 1 - through : red, 1e-6);
        }
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

/* 20000 up to i = 6, 40000 from i = 7 on. */
static bool two_halves(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)j;
    (void)k;
    (void)gradient;
    *code = i <= 6 ? 20000 : 40000;
    return true;
}

static void nearer_voxels_cover_those_behind(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = two_halves });
    for (int code = 0; code < 65536; code++)
        s.table[code] =
            code <= 30000 ? (trip_tf_entry){ 1, 0, 0, 0.2F } : (trip_tf_entry){ 0, 0, 1, 0.1F };
    const trip_settings settings = exact(1e-6);
    for (int side = -1; side <= 1; side += 2) {
        trip_camera_params view = scene_view(&s, trip_v3(side, 0, 0), 60, 20, 1);
        view.ortho_height = 0.1;
        scene_picture p = integrate(&s, &view, &settings);
        /* Halfway from i = 6 to 7 the value passes 30000, within a 20000th of a voxel. */
        double red = 6.5 * 0.2, blue = 12.5 * 0.1;
        double in_front = side < 0 ? red : blue;
        assert_close(p.rgba[0], exp(-(in_front == red ? 0 : blue)) * (1 - exp(-red)), 2e-5);
        assert_close(p.rgba[2], exp(-(in_front == red ? red : 0)) * (1 - exp(-blue)), 2e-5);
        assert_close(p.rgba[3], 1 - exp(-red - blue), 2e-5);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

/* The value jumps from 0 to 65535 between i = 9 and 10. */
static bool cliff(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)j;
    (void)k;
    (void)gradient;
    *code = i <= 9 ? 0 : 65535;
    return true;
}

static void a_narrow_peak_of_the_transfer_function_is_not_missed(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = cliff });
    const trip_settings settings = exact(1e-4);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0, 0), 60, 20, 1);
    view.ortho_height = 0.1;
    const int peaks[] = { 1, 300, 11111, 32768, 65533 };
    for (int i = 0; i < 5; i++) {
        /* A triangle two codes wide, with area 65535 codes. A ray that crosses it has optical
         * depth 1. */
        s.table[peaks[i]] = (trip_tf_entry){ 0.5F, 0, 0, 65535 };
        scene_picture p = integrate(&s, &view, &settings);
        assert_close(p.rgba[3], 1 - exp(-1), 1e-4);
        scene_picture_free(&p);
        s.table[peaks[i]] = (trip_tf_entry){ 0 };
    }
    scene_destroy(&s);
}

/* Every voxel except (9, 9, 9) is present. */
static bool all_but_one(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 65535;
    return !(i == 9 && j == 9 && k == 9);
}

static void a_cell_without_a_corner_is_empty(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = all_but_one });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 1, 1, 1, 0.1F };
    const trip_settings settings = exact(1e-6);
    trip_camera_params view = scene_view(&s, trip_v3(0, 0, 1), 60, 20, 1);
    view.ortho_height = 0.1;
    for (int i = 0; i < 3; i++) { /* through the cells around the missing voxel, then beside them */
        view.eye.x = view.look.x = 8.2 + i;
        view.eye.y = view.look.y = 9.4;
        scene_picture p = integrate(&s, &view, &settings);
        assert_close(p.rgba[3], 1 - exp(-0.1F * (i < 2 ? EDGE - 3 : EDGE - 1)), 1e-6);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

/* 600 (i - 9.5)^2 codes. */
static bool parabola(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)j;
    (void)k;
    (void)gradient;
    *code = (unsigned)lround(600 * (i - 9.5) * (i - 9.5));
    return true;
}

static void cubic_goes_through_a_parabola_and_linear_through_its_chords(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = parabola });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 1, 1, 1, 2.0F * (float)code / 65535 };
    trip_settings settings = exact(1e-6);
    trip_camera_params view = scene_view(&s, trip_v3(0, 1, 0), 60, 20, 1);
    view.ortho_height = 0.01;
    for (int i = 0; i < 8; i++) {
        double x = 3.3 + 1.6 * i, f = x - floor(x);
        view.eye.x = view.look.x = x;
        double code = 600 * (x - 9.5) * (x - 9.5), chord = code + 600 * f * (1 - f);
        settings.kernel = TRIP_KERNEL_CUBIC;
        scene_picture cubic = integrate(&s, &view, &settings);
        settings.kernel = TRIP_KERNEL_LINEAR;
        scene_picture linear = integrate(&s, &view, &settings);
        assert_close(cubic.rgba[3], 1 - exp(-2 * code / 65535 * (EDGE - 1)), 1e-5);
        assert_close(linear.rgba[3], 1 - exp(-2 * chord / 65535 * (EDGE - 1)), 1e-5);
        scene_picture_free(&cubic);
        scene_picture_free(&linear);
    }
    scene_destroy(&s);
}

/* The codes along z are 0, 60000, 60000 and 0. */
static bool peak(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)i, (void)j, (void)gradient;
    *code = k == 1 || k == 2 ? 60000 : 0;
    return true;
}

/* Only code 65535 is visible. The code is 60000 (1 + (t - t^2) / 2) in the middle cell, and at most
 * 60000 elsewhere. The function is constant beyond the table. */
static void a_cubic_cell_that_overshoots_the_table_counts_with_its_end(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 8, 8, 4 }, .voxel = peak });
    trip_settings settings = exact(1e-6);
    settings.kernel = TRIP_KERNEL_CUBIC;
    trip_camera_params view = scene_view(&s, trip_v3(0, 0, 1), 60, 20, 1);
    view.ortho_height = 0.01;
    for (int i = 0; i < 3; i++) {
        const float opaque[] = { 0.5F, 2, 20 };
        s.table[65535] = (trip_tf_entry){ 1, 1, 1, opaque[i] };
        const double beyond = sqrt(1 - 8 * (65534.5 / 60000 - 1));
        scene_picture p = integrate(&s, &view, &settings);
        assert_close(p.rgba[3], 1 - exp(-(double)opaque[i] * beyond), 1e-5);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

/* Gradients are differences of values, so that it does not matter whether normals are stored for
 * splats. */
static void values_are_lit_without_stored_normals(void **state)
{
    (void)state;
    scene_picture pictures[3]; /* the last picture is unlit */
    for (int i = 0; i < 3; i++) {
        scene s;
        scene_create(&s, &(scene_params){
                             .dims = { EDGE, EDGE, EDGE }, .voxel = parabola, .normals = i == 0 });
        for (int code = 0; code < 65536; code++)
            s.table[code] = (trip_tf_entry){ 0.5F, 0.5F, 0.5F, 2.0F * (float)code / 65535 };
        trip_settings settings = exact(1e-4);
        settings.shading = i < 2;
        trip_camera_params view = scene_view(&s, trip_v3(0.2, 1, 0.1), 60, 20, 5);
        pictures[i] = integrate(&s, &view, &settings);
        scene_destroy(&s);
    }
    assert_memory_equal(pictures[0].rgba, pictures[1].rgba, sizeof(float[4 * 25]));
    assert_true(scene_difference(&pictures[1], &pictures[2]) > 0.05);
    for (int i = 0; i < 3; i++)
        scene_picture_free(&pictures[i]);
}

/* A ball of radius *user in the centre of a cube. Values fall outwards by 0.05 per voxel; the
 * surface is at one half. */
static double ball(const double *radius, int i, int j, int k, double gradient[3])
{
    double middle = *radius + 4;
    trip_vec3 from = trip_v3(i - middle, j - middle, k - middle);
    trip_vec3 normal = trip_scale(trip_normalize(from), -0.05);
    gradient[0] = normal.x;
    gradient[1] = normal.y;
    gradient[2] = normal.z;
    return fmin(65535, fmax(0, 65535 * (0.5 + 0.05 * (*radius - trip_length(from)))));
}

static bool ball_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    *code = (unsigned)lround(ball(user, i, j, k, gradient));
    return true;
}

/* Returns the maximum error within 0.8 of the ball's radius. The surface is opaque and lit from
 * the eye. */
static double error_of_ball(const scene *s, double radius, const scene_making *how)
{
    enum { SIZE = 31 };
    trip_settings settings = exact(1e-4);
    settings.shading = true;
    trip_camera_params view = scene_view(s, trip_v3(0.2, -1, 0.4), 200, 20, SIZE);
    view.ortho_height = 2 * radius;
    scene_picture p = scene_integrate(s, &view, &settings, how);
    double max = 0;
    for (int n = 0; n < SIZE * SIZE; n++) {
        double x = (n % SIZE + 0.5) / SIZE * 2 - 1, y = (n / SIZE + 0.5) / SIZE * 2 - 1;
        if (x * x + y * y > 0.64)
            continue;
        /* The cosine is the same for the normal, the light and the half vector. */
        double facing = sqrt(1 - x * x - y * y);
        double red = 0.6 * (TRIP_AMBIENT + TRIP_DIFFUSE * facing) +
                     TRIP_SPECULAR * pow(facing, TRIP_SHININESS);
        max = fmax(max, fabs(red - (double)scene_pixel(&p, n % SIZE, n / SIZE)[0]));
    }
    scene_picture_free(&p);
    return max;
}

/* The light is at a given angle from the eye. Lit and visible parts shine, except if the light is
 * behind the surface. */
static void a_ball_shines_where_lit_and_visible(void **state)
{
    (void)state;
    enum { SIZE = 31 };
    scene s;
    double radius = 24;
    scene_create(
        &s, &(scene_params){
                .dims = { 57, 57, 57 }, .normals = true, .voxel = ball_voxel, .user = &radius });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 0.6F, 0.6F, 0.6F, code < 32768 ? 0 : 1000 };
    trip_settings settings = exact(1e-4);
    settings.shading = true;
    settings.headlight = false;
    trip_camera_params view = scene_view(&s, trip_v3(0.2, -1, 0.4), 200, 20, SIZE);
    view.ortho_height = 2 * radius;
    trip_vec3 eye = trip_normalize(trip_sub(view.eye, view.look));
    trip_vec3 right = trip_normalize(trip_cross(view.up, eye)), up = trip_cross(eye, right);
    for (int degrees = 20; degrees < 180; degrees += 50) {
        double angle = degrees * (3.14159265358979323846 / 180), max = 0, brightest = 0;
        settings.light_direction =
            trip_add(trip_scale(eye, cos(angle)), trip_scale(right, sin(angle)));
        scene_picture p = integrate(&s, &view, &settings);
        for (int n = 0; n < SIZE * SIZE; n++) {
            double x = (n % SIZE + 0.5) / SIZE * 2 - 1, y = 1 - (n / SIZE + 0.5) / SIZE * 2;
            if (x * x + y * y > 0.81)
                continue;
            trip_vec3 normal = trip_add(trip_scale(right, x), trip_scale(up, y));
            normal = trip_add(normal, trip_scale(eye, sqrt(1 - x * x - y * y)));
            double to_light = trip_dot(normal, settings.light_direction);
            trip_vec3 half = trip_normalize(trip_add(eye, settings.light_direction));
            double shine = TRIP_SPECULAR * pow(trip_dot(normal, half), TRIP_SHININESS);
            shine *= fmin(1, fmax(0, 4 * to_light * trip_dot(normal, eye)));
            double red = 0.6 * (TRIP_AMBIENT + TRIP_DIFFUSE * fabs(to_light)) + shine;
            max = fmax(max, fabs(red - (double)scene_pixel(&p, n % SIZE, n / SIZE)[0]));
            brightest = fmax(brightest, shine);
        }
        assert_true(max < 0.002);
        assert_true(degrees <= 120 ? brightest > 0.15 : brightest < 0.01);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

static void put_ball(trip_field *f, double radius)
{
    const int64_t *dims = trip_field_dims(f);
    for (int64_t n = 0; n < dims[0] * dims[1] * dims[2]; n++) {
        const int64_t at[3] = { n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1] };
        double gradient[3];
        double code = ball(&radius, (int)at[0], (int)at[1], (int)at[2], gradient);
        assert_int_equal(trip_field_put(f, at, code, NULL), 0);
    }
    assert_int_equal(
        trip_field_finish(f, &(trip_field_map){ .index_to_world = trip_affine_identity(),
                                                .value_per_code = 1.0 / 65535 }),
        0);
}

/* Normals are stored in 4 bytes or in 3, or computed as differences of values. */
static void the_colours_of_a_lit_ball_converge_with_resolution(void **state)
{
    (void)state;
    for (int form = 0; form < 3; form++) {
        double errors[3];
        for (int i = 0; i < 3; i++) {
            scene s;
            trip_field *field = NULL;
            double radius = 6 << i;
            int64_t edge = (int64_t)(2 * radius + 9);
            scene_create(&s, &(scene_params){ .dims = { edge, edge, edge },
                                              .normals = true,
                                              .normal_bytes = form == 1 ? 3 : 4,
                                              .voxel = ball_voxel,
                                              .user = &radius });
            for (int code = 0; code < 65536; code++)
                s.table[code] = (trip_tf_entry){ 0.6F, 0.6F, 0.6F, code < 32768 ? 0 : 1000 };
            if (form == 2) {
                assert_int_equal(
                    trip_field_create(&field, (int64_t[3]){ edge, edge, edge }, s.budget), 0);
                put_ball(field, radius);
            }
            errors[i] = error_of_ball(&s, radius, &(scene_making){ .threads = 2, .field = field });
            trip_field_destroy(field);
            scene_destroy(&s);
        }
        /* Normals in 3 bytes keep an error that no resolution reduces, see normal.h. */
        double left = form == 1 ? 0.5 / 255 : 0;
        assert_true(errors[0] < 0.005);
        assert_true(errors[1] < left + 0.4 * errors[0]);
        assert_true(errors[2] < left + 0.4 * errors[1]);
    }
}

static bool one_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 7;
    return i == 9 && j == 10 && k == 8;
}

static void a_splat_is_a_gaussian_cut_off_and_lowered(void **state)
{
    (void)state;
    for (int i = 0; i < 8; i++) {
        scene s;
        const double k = TRIP_CUTOFF, edge = exp(-k * k / 2);
        int covered = 0;
        scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                          .voxel = one_voxel,
                                          .index_to_world =
                                              i % 2 ? scene_sheared : trip_affine_identity() });
        s.table[7] = (trip_tf_entry){ 0.2F, 0.4F, 1, 3 };
        trip_settings settings = exact(1e-7);
        settings.field = TRIP_FIELD_SPLATS;
        settings.kernel_radius = i / 2 % 2 ? 3 : 2;
        double sigma = settings.kernel_radius / k, twice = 2 * sigma * sigma;
        trip_camera_params view = scene_view(&s, trip_v3(1, 0.3, -0.4), 40, 14, 15);
        view.ortho_height = i / 4 ? 8 : 0;
        scene_picture p = integrate(&s, &view, &settings);
        for (int n = 0; n < 225; n++) {
            trip_vec3 o, d;
            scene_ray(&s, &view, n % 15, n / 15, &o, &d);
            trip_vec3 across = trip_cross(trip_sub(trip_v3(9, 10, 8), o), d);
            double d2 = trip_dot(across, across);
            double footprint = d2 < k * k * sigma * sigma ? exp(-d2 / twice) - edge : 0;
            /* The footprint has unit integral over the plane. */
            footprint /= 3.14159265358979323846 * twice * (1 - edge * (1 + k * k / 2));
            double alpha = 1 - exp(-3 * scene_ray_stretch(&s, d) * footprint);
            covered += alpha > 0.01;
            assert_close(scene_pixel(&p, n % 15, n / 15)[3], alpha, 1e-6);
            assert_close(scene_pixel(&p, n % 15, n / 15)[1], 0.4F * alpha, 1e-6);
        }
        assert_in_range(covered, 5, 225);
        scene_picture_free(&p);
        scene_destroy(&s);
    }
}

static void half_of_a_splat_at_the_eye_counts(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = one_voxel });
    s.table[7] = (trip_tf_entry){ 1, 1, 1, 3 };
    trip_settings settings = exact(1e-7);
    settings.field = TRIP_FIELD_SPLATS;
    trip_camera_params view = scene_view(&s, trip_v3(1, 0, 0), 1, 20, 1);
    double k = TRIP_CUTOFF, sigma = settings.kernel_radius / k, edge = exp(-k * k / 2);
    double whole =
        (1 - edge) / (2 * 3.14159265358979323846 * sigma * sigma) / (1 - edge * (1 + k * k / 2));
    view.eye = trip_v3(9, 10, 8);
    view.look = trip_v3(7, 10.5, 8.2);
    scene_picture p = integrate(&s, &view, &settings);
    assert_close(p.rgba[3], 1 - exp(-3 * whole / 2), 1e-6);
    scene_picture_free(&p);
    scene_destroy(&s);
}

/* The integral counts the splat's own density from the eye on; front() counts a Gaussian. */
static void one_splat_about_the_eye_has_its_integral(void **state)
{
    (void)state;
    enum { SIZE = 24 };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = one_voxel });
    s.table[7] = (trip_tf_entry){ 1, 1, 1, 2 };
    trip_settings settings = exact(1e-6);
    settings.field = TRIP_FIELD_SPLATS;
    for (int i = 0; i < 9; i++) {
        trip_camera_params view = { .eye = { 6.6 + 0.5 * i, 10.3, 8.4 },
                                    .up = { 0, 0, 1 },
                                    .fov_degrees = 100,
                                    .width = SIZE,
                                    .height = SIZE };
        view.look = trip_add(view.eye, trip_v3(1, 0.1, 0.2));
        scene_picture exact = integrate(&s, &view, &settings);
        for (const scene_renderer *r = scene_renderers(); r->name; r++) {
            scene_picture p = scene_draw(&s, r, &view, &settings);
            double max = scene_difference(&exact, &p);
            assert_true(max < 0.008);
            scene_picture_free(&p);
        }
        scene_picture_free(&exact);
    }
    scene_destroy(&s);
}

/* Noise in every voxel, with gradients. */
static bool noise(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    *code = scene_hash(i, j, k) % 65536;
    for (int a = 0; a < 3; a++)
        gradient[a] = 0.2 * (scene_hash(k, i + a, j) % 1000 / 1000.0 - 0.5);
    return scene_hash(j, k, i) % 7 != 0;
}

/* Sets stripes of many hues, alternately thin and dense. */
static void set_stripes(scene *s)
{
    for (int code = 0; code < 65536; code++) {
        int stripe = code / 3000;
        s->table[code] = (trip_tf_entry){ (float)(stripe % 3) / 2, (float)(stripe % 5) / 4,
                                          (float)(stripe % 7) / 6, stripe % 4 ? 0 : 0.7F };
    }
}

static void the_error_is_within_the_tolerance(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 10, 10, 10 }, .normals = true, .voxel = noise });
    set_stripes(&s);
    for (int i = 0; i < 4; i++) {
        trip_camera_params view = scene_view(&s, trip_v3(1, 0.3, -0.4), 20, 30, 8);
        trip_settings settings = exact(1e-7);
        settings.shading = true;
        settings.kernel = (trip_kernel)(i % 2);
        settings.field = i < 2 ? TRIP_FIELD_VALUES : TRIP_FIELD_SPLATS;
        scene_picture best = integrate(&s, &view, &settings);
        for (double tolerance = 1e-1; tolerance > 1e-5; tolerance /= 10) {
            settings.tolerance = tolerance;
            scene_picture p = integrate(&s, &view, &settings);
            double apart = scene_difference(&p, &best);
            assert_true(apart <= tolerance);
            scene_picture_free(&p);
        }
        scene_picture_free(&best);
    }
    scene_destroy(&s);
}

static void threads_and_panes_change_no_bit(void **state)
{
    (void)state;
    for (int field = 0; field < 2; field++) {
        scene_picture first = { 0 };
        for (int i = 0; i < 4; i++) {
            scene s;
            scene_create(&s, &(scene_params){ .dims = { 30, 20, 10 },
                                              .normals = true,
                                              .tile_voxels = i / 2 ? 16 : 64,
                                              .slab_sheets = i / 2 ? 3 : 8,
                                              .voxel = noise });
            set_stripes(&s);
            trip_camera_params view = scene_view(&s, trip_v3(1, 0.3, -0.4), 60, 25, 13);
            trip_settings settings = exact(1e-4);
            settings.shading = true;
            settings.field = (trip_field_kind)field;
            scene_picture p = scene_integrate(
                &s, &view, &settings, &(scene_making){ .threads = 1 + 2 * (unsigned)(i % 2) });
            if (i == 0)
                first = p;
            else
                assert_memory_equal(p.rgba, first.rgba, 13 * 13 * 4 * sizeof *p.rgba);
            if (i > 0)
                scene_picture_free(&p);
            scene_destroy(&s);
        }
        scene_picture_free(&first);
    }
}

static void keep_progress(void *user, const char *stage, uint64_t done, uint64_t total)
{
    uint64_t *last = user;
    if (strcmp(stage, "integrate"))
        return;
    assert_true(done > last[0] && done <= total);
    last[0] = done;
    last[1] = total;
}

static void progress_rises_to_the_number_of_pixels(void **state)
{
    (void)state;
    scene s;
    uint64_t last[2] = { 0 };
    scene_create(&s, &(scene_params){ .dims = { 10, 10, 10 }, .voxel = noise });
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.3, -0.4), 20, 40, 21);
    const trip_settings settings = exact(1e-2);
    scene_picture p = scene_integrate(
        &s, &view, &settings, &(scene_making){ .progress = keep_progress, .progress_user = last });
    assert_int_equal(last[0], 21 * 21);
    assert_int_equal(last[1], 21 * 21);
    scene_picture_free(&p);
    scene_destroy(&s);
}

static void samples_are_the_mean_of_a_finer_picture(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 10, 10, 10 }, .voxel = noise });
    set_stripes(&s);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.3, -0.4), 20, 40, 18);
    trip_settings settings = exact(1e-5);
    settings.background[3] = 1;
    settings.background[1] = 0.5;
    scene_picture fine = integrate(&s, &view, &settings);
    view.width = view.height = 6;
    settings.samples = 3;
    scene_picture p = integrate(&s, &view, &settings);
    for (int n = 0; n < 36 * 4; n++) {
        double sum = 0;
        for (int i = 0; i < 9; i++)
            sum += scene_pixel(&fine, n / 4 % 6 * 3 + i % 3, n / 24 * 3 + i / 3)[n % 4];
        assert_close(p.rgba[n], sum / 9, 1e-6);
    }
    scene_picture_free(&fine);
    scene_picture_free(&p);
    scene_destroy(&s);
}

/* Seen along an axis in a parallel view, a constant body is a square with one opacity. A pixel at
 * its border has the opacity times the share of its area that the square covers. */
static void a_pixel_counts_by_its_area(void **state)
{
    (void)state;
    enum { SIZE = 8 };
    const double alpha = 1 - exp(-0.05F * (EDGE - 1)), tolerance = 1e-3;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                      .index_to_world = trip_affine_identity() });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 1, 0.5F, 0.25F, 0.05F };
    for (double height = 23.7; height < 300; height *= 1.37) {
        trip_camera_params view = scene_view(&s, trip_v3(0, 0, 1), 60, 40, SIZE);
        view.ortho_height = height;
        trip_settings settings = exact(tolerance);
        settings.samples = 0;
        scene_picture p = integrate(&s, &view, &settings);
        const double half = (EDGE - 1) / height * SIZE / 2; /* of the square, in pixels */
        for (int n = 0; n < SIZE * SIZE; n++) {
            double share = 1;
            for (int axis = 0; axis < 2; axis++) {
                const double from = (axis ? n / SIZE : n % SIZE) - SIZE / 2;
                share *= fmax(0, fmin(from + 1, half) - fmax(from, -half));
            }
            assert_close(scene_pixel(&p, n % SIZE, n / SIZE)[3], share * alpha, tolerance);
            assert_close(scene_pixel(&p, n % SIZE, n / SIZE)[1], share * alpha / 2, tolerance);
        }
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

static double mean_difference(const scene_picture *a, const scene_picture *b)
{
    const int count = 4 * a->width * a->height;
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += fabs((double)a->rgba[i] - (double)b->rgba[i]) / count;
    return sum;
}

/* Compares with many rays per pixel, for pixels smaller and larger than voxels. The values are
 * noise and the stripes narrow, so that a square may hold several steps. Then its points may agree
 * by chance, and a few pixels miss the tolerance. */
static void the_mean_over_the_area_is_the_limit_of_many_rays(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 10, 10, 10 }, .normals = true, .voxel = noise });
    set_stripes(&s);
    for (int i = 0; i < 4; i++) {
        const double tolerance = 4e-3;
        trip_camera_params view =
            scene_view(&s, trip_v3(1, 0.3, -0.4), 20, i % 2 ? 60 : 25, i % 2 ? 4 : 8);
        trip_settings settings = exact(1e-4);
        settings.shading = true;
        settings.field = i < 2 ? TRIP_FIELD_VALUES : TRIP_FIELD_SPLATS;
        settings.samples = 25;
        scene_picture many = integrate(&s, &view, &settings);
        settings.samples = 0;
        settings.tolerance = tolerance;
        scene_picture area = integrate(&s, &view, &settings);
        assert_true(mean_difference(&area, &many) <= tolerance / 4);
        assert_true(scene_difference(&area, &many) <= 3 * tolerance);
        scene_picture_free(&area);
        scene_picture_free(&many);
    }
    scene_destroy(&s);
}

/* A data set rounds values to whole codes. If extinction is linear in the code, the optical depth
 * of a path differs by at most half a code along the path. */
static void codes_lose_at_most_their_rounding(void **state)
{
    (void)state;
    scene s;
    trip_field *field;
    double radius = 6, rise = 30;
    int64_t edge = (int64_t)(2 * radius + 9);
    scene_create(
        &s, &(scene_params){ .dims = { edge, edge, edge }, .voxel = ball_voxel, .user = &radius });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 1, 1, 1, (float)(rise * fmax(0, code - 32768) / 65535) };
    assert_int_equal(trip_field_create(&field, (int64_t[3]){ edge, edge, edge }, s.budget), 0);
    put_ball(field, radius);
    const trip_settings settings = exact(1e-9);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.3, -0.4), 60, 20, 16);
    scene_picture stored = integrate(&s, &view, &settings);
    scene_picture source = scene_integrate(&s, &view, &settings, &(scene_making){ .field = field });
    double depth = rise * 0.5 / 65535 * 2 * (radius + 1),
           apart = scene_difference(&stored, &source);
    assert_true(apart > 1e-7 && apart < depth);
    scene_picture_free(&stored);
    scene_picture_free(&source);
    trip_field_destroy(field);
    scene_destroy(&s);
}

/* Splats of one colour do not depend on their order, and their opacity equals the integral. The
 * low-pass filter adds a difference that shrinks with the pixel size. */
static void the_reference_converges_to_the_integral_of_its_splats(void **state)
{
    (void)state;
    enum { SIZE = 12 };
    scene s;
    double errors[3] = { 0 };
    const scene_renderer reference = { "reference", trip_reference_create, 0 };
    scene_create(&s, &(scene_params){ .dims = { 8, 8, 8 }, .voxel = noise });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 0.9F, 0.6F, 0.3F, code > 40000 ? 0.3F : 0 };
    trip_settings settings = exact(1e-6);
    settings.h = 0;
    settings.field = TRIP_FIELD_SPLATS;
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.3, -0.4), 20, 0, SIZE);
    view.ortho_height = 6;
    scene_picture truth = integrate(&s, &view, &settings);
    for (int i = 0; i < 3; i++) { /* 2, 6 and 18 pixels a voxel; the same rays */
        int finer = i == 0 ? 1 : i == 1 ? 3 : 9;
        view.width = view.height = SIZE * finer;
        scene_picture splats = scene_draw(&s, &reference, &view, &settings);
        for (int n = 0; n < SIZE * SIZE; n++) {
            const float *drawn =
                scene_pixel(&splats, n % SIZE * finer + finer / 2, n / SIZE * finer + finer / 2);
            errors[i] = fmax(errors[i], test_max_apart(drawn, truth.rgba + 4 * n, 4));
        }
        scene_picture_free(&splats);
    }
    scene_picture_free(&truth);
    /* The low-pass filter adds a variance that falls with the square of the pixel size. */
    assert_true(errors[0] > 1e-3);
    assert_close(errors[1] / errors[0], 1.0 / 9, 0.05);
    assert_close(errors[2] / errors[1], 1.0 / 9, 0.05);
    scene_destroy(&s);
}

static void integrals_that_exceed_the_memory_are_refused(void **state)
{
    (void)state;
    trip_budget *budget;
    trip_field *field;
    const int64_t at[3] = { 3, 3, 3 };
    assert_int_equal(trip_budget_create(&budget, 1 << 20), 0);
    test_catch_reports();
    assert_int_equal(
        trip_field_create(&field, (int64_t[3]){ INT32_MAX, INT32_MAX, INT32_MAX }, budget),
        TRIP_ERROR);
    assert_null(field);
    assert_int_equal(test_report_count, 1);
    assert_int_equal(trip_field_create(&field, (int64_t[3]){ 64, 64, 64 }, budget), 0);
    assert_int_equal(trip_field_put(field, at, 1, NULL), TRIP_ERROR);
    assert_int_equal(test_report_count, 2);
    assert_non_null(strstr(test_last_report, "--memory"));
    trip_field_destroy(field);
    trip_report_redirect(NULL, NULL);
    trip_budget_destroy(budget);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_constant_body_has_the_opacity_of_the_path_in_it),
        cmocka_unit_test(a_ramp_is_integrated_in_extinction_and_in_colour),
        cmocka_unit_test(nearer_voxels_cover_those_behind),
        cmocka_unit_test(a_narrow_peak_of_the_transfer_function_is_not_missed),
        cmocka_unit_test(a_cell_without_a_corner_is_empty),
        cmocka_unit_test(values_are_lit_without_stored_normals),
        cmocka_unit_test(cubic_goes_through_a_parabola_and_linear_through_its_chords),
        cmocka_unit_test(a_cubic_cell_that_overshoots_the_table_counts_with_its_end),
        cmocka_unit_test(a_ball_shines_where_lit_and_visible),
        cmocka_unit_test(the_colours_of_a_lit_ball_converge_with_resolution),
        cmocka_unit_test(a_splat_is_a_gaussian_cut_off_and_lowered),
        cmocka_unit_test(one_splat_about_the_eye_has_its_integral),
        cmocka_unit_test(half_of_a_splat_at_the_eye_counts),
        cmocka_unit_test(the_error_is_within_the_tolerance),
        cmocka_unit_test(threads_and_panes_change_no_bit),
        cmocka_unit_test(progress_rises_to_the_number_of_pixels),
        cmocka_unit_test(samples_are_the_mean_of_a_finer_picture),
        cmocka_unit_test(a_pixel_counts_by_its_area),
        cmocka_unit_test(the_mean_over_the_area_is_the_limit_of_many_rays),
        cmocka_unit_test(codes_lose_at_most_their_rounding),
        cmocka_unit_test(the_reference_converges_to_the_integral_of_its_splats),
        cmocka_unit_test(integrals_that_exceed_the_memory_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
