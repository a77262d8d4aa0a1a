/* Gaussian scenes by gl: closed forms, hard cases beside cpu and the reference, memory, cancelling.
 * The mean difference is below 0.01 of 255, and no pixel differs by 2. Rounding may move a pixel to
 * the other side of a bound of alpha. */
#include "gaussians_cpu.h"
#include "gaussians_reference.h"
#include "scenes.h"
#include "test.h"

enum { WIDTH = 150, HEIGHT = 90, PIXELS = WIDTH * HEIGHT, SCENE = 3000, MANY = 5000 };

/* ---- scenes ---- */

static trip_camera camera_at(trip_vec3 eye, double ortho_height, int width, int height)
{
    const trip_camera_params params = { .eye = eye,
                                        .look = trip_add(eye, trip_v3(0, 0, 1)),
                                        .up = trip_v3(0, 1, 0),
                                        .fov_degrees = 60,
                                        .ortho_height = ortho_height,
                                        .width = width,
                                        .height = height };
    const trip_affine identity = trip_affine_identity();
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &params, &identity), 0);
    return c;
}

/* Looks along z from the origin. */
static trip_camera camera_of(double ortho_height)
{
    return camera_at(trip_v3(0, 0, 0), ortho_height, WIDTH, HEIGHT);
}

static trip_gaussian round_at(double x, double y, double z, double deviation, double opacity)
{
    const float d = (float)deviation;
    return (trip_gaussian){ .centre = { x, y, z },
                            .deviations = { d, d, d },
                            .rotation = { 1, 0, 0, 0 },
                            .opacity = (float)opacity };
}

/* Gives a Gaussian a colour that does not depend on the direction. */
static void colour(trip_gaussian *g, double r, double green, double b)
{
    const double sh0 = sqrt(4 * 3.14159265358979323846);
    g->sh[0][0] = (float)((r - 0.5) * sh0);
    g->sh[0][1] = (float)((green - 0.5) * sh0);
    g->sh[0][2] = (float)((b - 0.5) * sh0);
}

static int nearer(const void *a, const void *b)
{
    const double x = ((const trip_gaussian *)a)->centre[2],
                 y = ((const trip_gaussian *)b)->centre[2];
    return (x > y) - (x < y);
}

/* A repeatable scene around an eye, in order of depth. Many Gaussians are small, some are long and
 * thin, very large, opaque or flat. Some are near the eye, and some behind it. */
static const trip_gaussian *random_scene(trip_vec3 eye)
{
    static trip_gaussian plain[SCENE], moved[SCENE];
    for (int i = 0; i < SCENE && plain[SCENE - 1].opacity <= 0; i++) {
        trip_gaussian *g = &plain[i];
        const double z = -1 + 21 * test_random(), size = i % 200 == 0 ? 3 : 0.15;
        const double x = z * (2 * test_random() - 1), y = z * (2 * test_random() - 1);
        *g = round_at(x, y, z, 0, i % 3 ? 0.01 + 0.98 * test_random() : 1);
        for (int k = 0; k < 4; k++)
            g->rotation[k] = (float)(2 * test_random() - 1);
        double length = 0;
        for (int k = 0; k < 4; k++)
            length += (double)(g->rotation[k] * g->rotation[k]);
        for (int k = 0; k < 4; k++)
            g->rotation[k] /= (float)sqrt(length);
        for (int k = 0; k < 3; k++)
            g->deviations[k] = (float)(size * exp(-4 * test_random()));
        if (i % 50 == 0)
            g->deviations[1] = 0;
        for (int k = 0; k < TRIP_SH_MAX; k++)
            for (int channel = 0; channel < 3; channel++)
                g->sh[k][channel] = (float)(test_random() - 0.5);
    }
    memcpy(moved, plain, sizeof moved);
    qsort(moved, SCENE, sizeof *moved, nearer);
    for (int i = 0; i < SCENE; i++) {
        moved[i].centre[0] += eye.x;
        moved[i].centre[1] += eye.y;
        moved[i].centre[2] += eye.z;
    }
    return moved;
}

static const trip_gaussian_settings full = {
    .degree = 3, .antialiased = true, .background = { 0.2, 0.4, 0.6, 0.9 }, .depth = true
};

/* ---- drawing ---- */

typedef struct desk {
    trip_budget *budget;
    trip_renderer *renderer;
    const trip_tile_device *device;
} desk;

static desk open_desk(uint64_t memory_bytes)
{
    desk d;
    assert_int_equal(trip_budget_create(&d.budget, memory_bytes), 0);
    assert_int_equal(trip_gl_create(&d.renderer, d.budget), 0);
    d.device = d.renderer->ops->tile_device(d.renderer);
    assert_non_null(d.device);
    return d;
}

static void close_desk(desk *d)
{
    d->renderer->ops->destroy(d->renderer);
    assert_true(trip_budget_left_bytes(d->budget) == trip_budget_limit_bytes(d->budget));
    trip_budget_destroy(d->budget);
}

static trip_gaussians_cpu *begin(const desk *d, const trip_camera *c,
                                 const trip_gaussian_settings *s)
{
    trip_gaussians_cpu *g;
    const trip_gaussians_cpu_params params = {
        .camera = c, .settings = s, .budget = d->budget, .device = d->device
    };
    assert_int_equal(trip_gaussians_cpu_begin(&g, &params), 0);
    return g;
}

/* Draws with the device of a desk, or by cpu if the desk has none. */
static void draw(const desk *d, float *rgba, float *depth, const trip_camera *c,
                 const trip_gaussian_settings *s, const trip_gaussian *gaussians, size_t count)
{
    const uint64_t left = trip_budget_left_bytes(d->budget);
    trip_gaussians_cpu *g = begin(d, c, s);
    assert_int_equal(trip_gaussians_cpu_add(g, gaussians, count), 0);
    assert_int_equal(trip_gaussians_cpu_picture(g, rgba, s->depth ? depth : NULL), 0);
    trip_gaussians_cpu_end(g);
    assert_true(trip_budget_left_bytes(d->budget) == left);
}

static void draw_reference(const desk *d, float *rgba, float *depth, const trip_camera *c,
                           const trip_gaussian_settings *s, const trip_gaussian *gaussians,
                           size_t count)
{
    trip_gaussians_reference *r;
    assert_int_equal(trip_gaussians_reference_begin(&r, c, s, d->budget), 0);
    assert_int_equal(trip_gaussians_reference_add(r, gaussians, count), 0);
    trip_gaussians_reference_picture(r, rgba, s->depth ? depth : NULL);
    trip_gaussians_reference_end(r);
}

static void expect_near(const float *one, const float *other, const char *name)
{
    double sum = 0;
    for (int i = 0; i < 4 * PIXELS; i++)
        sum += fabs((double)one[i] - (double)other[i]);
    const double most = test_max_apart(one, other, 4 * PIXELS);
    if (sum / (4 * PIXELS) < 0.01 / 255 && most < 2.0 / 255)
        return;
    fail_msg("gl differs from %s by %.4f, at most %.3f of 255", name, 255 * sum / (4 * PIXELS),
             255 * most);
}

static void expect_near_depth(const float *one, const float *other)
{
    for (int i = 0; i < PIXELS; i++)
        if (isinf(other[i]))
            assert_true(isinf(one[i]));
        else
            assert_close((double)one[i], (double)other[i], 0.02);
}

/* Compares gl with cpu and the reference, and expects a mean opacity. */
static void expect_all(const trip_camera *c, const trip_gaussian_settings *s,
                       const trip_gaussian *gaussians, size_t count, double opacity)
{
    static float rgba[3][4 * PIXELS], depth[3][PIXELS];
    desk d = open_desk(256u << 20);
    desk cpu = { .budget = d.budget };
    draw(&d, rgba[0], depth[0], c, s, gaussians, count);
    draw(&cpu, rgba[1], depth[1], c, s, gaussians, count);
    draw_reference(&d, rgba[2], depth[2], c, s, gaussians, count);
    double sum = 0;
    for (int i = 0; i < PIXELS; i++)
        sum += (double)rgba[2][4 * i + 3];
    assert_true(sum / PIXELS > opacity);
    expect_near(rgba[0], rgba[1], "cpu");
    expect_near(rgba[0], rgba[2], "the reference");
    if (s->depth) {
        expect_near_depth(depth[0], depth[1]);
        expect_near_depth(depth[0], depth[2]);
    }
    close_desk(&d);
}

/* ---- closed forms ---- */

/* 10 px per unit. The centre of pixel (75, 45) is at (75.5, 45.5). */
static const double units_high = 9;

static void a_gaussian_has_its_opacity_width_and_distance(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    static float rgba[4 * PIXELS], depth[PIXELS];
    const trip_camera c = camera_of(units_high);
    trip_gaussian g[2] = { round_at(-0.05, -0.05, 5, 0.4, 0.8),
                           round_at(-0.05, -0.05, 8, 0.4, 0.5) };
    colour(&g[0], 1, 0.5, 0.25);
    colour(&g[1], 0, 0, 1);
    desk d = open_desk(64u << 20);
    draw(&d, rgba, depth, &c, &(trip_gaussian_settings){ .depth = true }, g, 2);
    for (int at = -19; at < 20; at++) {
        double alpha[2], e = exp(-0.5 * at * at / (16 + 0.3));
        for (int i = 0; i < 2; i++)
            alpha[i] = (double)g[i].opacity * e >= 1.0 / 255 ? (double)g[i].opacity * e : 0;
        const double back = (1 - alpha[0]) * alpha[1], all = alpha[0] + back;
        const int pixel = 45 * WIDTH + 75 + at;
        assert_close((double)rgba[4 * pixel], alpha[0], 1e-6);
        assert_close((double)rgba[4 * pixel + 1], 0.5 * alpha[0], 1e-6);
        assert_close((double)rgba[4 * pixel + 2], 0.25 * alpha[0] + back, 1e-6);
        assert_close((double)rgba[4 * pixel + 3], all, 1e-6);
        if (all > 0)
            assert_close((double)depth[pixel], (5 * alpha[0] + 8 * back) / all, 1e-5);
        else
            assert_true(isinf(depth[pixel]));
    }
    close_desk(&d);
}

/* The transmittance after two Gaussians is 1e-4, which is not below 1e-4. After the third it would
 * be 1e-6, so the third and all later ones are left out, faint ones too. */
static void a_pixel_stops_before_its_transmittance_is_too_small(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    static float rgba[4 * PIXELS];
    const trip_camera c = camera_of(units_high);
    trip_gaussian g[4];
    for (int i = 0; i < 4; i++) {
        g[i] = round_at(-0.05, -0.05, 5 + i, 0.4, i < 3 ? 1 : 0.1);
        colour(&g[i], i == 1, i == 2 ? 1e20 : 0, i == 3 ? 1e20 : 0);
    }
    desk d = open_desk(64u << 20);
    const float *p = rgba + 4 * (45 * WIDTH + 75);
    draw(&d, rgba, NULL, &c, &(trip_gaussian_settings){ 0 }, g, 4);
    assert_close((double)p[3], 1 - 1e-4, 1e-7);
    assert_close((double)p[0], 0.01 * 0.99, 1e-7);
    assert_close((double)p[1], 0, 0);
    assert_close((double)p[2], 0, 0);
    draw(&d, rgba, NULL, &c, &(trip_gaussian_settings){ .early_termination = 0.5 }, g, 4);
    assert_close((double)p[3], 0, 0);
    draw(&d, rgba, NULL, &c, &(trip_gaussian_settings){ .early_termination = 1e-30 }, g, 4);
    assert_close((double)p[1], 1e-4 * 0.99 * 1e20, 1e-5);
    assert_close((double)p[2], 1e-6 * 0.1 * 1e20, 1e-5);
    close_desk(&d);
}

/* ---- beside cpu and the reference ---- */

static void all_shapes_agree_in_both_projections(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    for (int parallel = 0; parallel < 2; parallel++)
        for (int shape = TRIP_GAUSSIAN_PROJECTED; shape <= TRIP_GAUSSIAN_EWA; shape++) {
            const trip_camera c = camera_of(parallel ? 12 : 0);
            trip_gaussian_settings s = full;
            s.shape = (trip_gaussian_shape)shape;
            s.depth = shape != TRIP_GAUSSIAN_EWA;
            expect_all(&c, &s, random_scene(c.eye), SCENE, 0.9);
        }
}

static void clipping_and_opacity_scale_agree(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    const trip_camera c = camera_of(0);
    trip_gaussian_settings s = { .degree = 1, .early_termination = 0.02, .opacity_scale = 0.3 };
    trip_clip_add(&s.clip, trip_v3(0, 0.6, 0.8), -4);
    expect_all(&c, &s, random_scene(c.eye), SCENE, 0.1);
}

/* Coordinates of maps, in metres. */
static void far_coordinates_agree(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    const trip_camera c = camera_at(trip_v3(500000.3, 4000000.7, 64), 0, WIDTH, HEIGHT);
    expect_all(&c, &full, random_scene(c.eye), SCENE, 0.9);
}

/* Each case alone fills the picture or a pixel of it. */
static void hard_gaussians_agree(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    static trip_gaussian in_a_pixel[MANY];
    for (int i = 0; i < MANY; i++) {
        in_a_pixel[i] = round_at(-0.02, -0.02, 2 + 0.001 * i, 1e-4, i % 7 ? 0.005 : 0.1);
        colour(&in_a_pixel[i], i % 2, i % 3, i % 5);
    }
    trip_gaussian edge_on = round_at(0.4, 0, 3, 1, 0.9), around = round_at(0, 0, 0.3, 50, 0.7);
    edge_on.deviations[0] = 0;
    edge_on.centre[0] = 0;
    /* It ends at its horizon, in the middle of the picture. */
    trip_gaussian ground = round_at(0, -1, 3, 5, 0.9);
    ground.deviations[1] = 0;
    /* A needle of 1e6 px, with its centre far outside, crosses the picture on a diagonal. */
    trip_gaussian needle = round_at(20000, 10000, 10, 0.02, 0.99);
    needle.deviations[0] = 20000;
    needle.rotation[0] = (float)cos(atan(0.5) / 2);
    needle.rotation[3] = (float)sin(atan(0.5) / 2);
    const struct {
        const trip_gaussian *gaussians;
        size_t count;
        double opacity;
    } cases[] = {
        { &edge_on, 1, 1e-4 },
        { &around, 1, 0.5 },
        { &ground, 1, 1e-4 },
        { (trip_gaussian[]){ round_at(0, 0, 0, 0, 0) }, 1, -1 }, /* at the eye */
        { (trip_gaussian[]){ round_at(0, 0, -5, 1, 1) }, 1, -1 },
        { (trip_gaussian[]){ round_at(0.1, 0.1, 5, 1e-30, 1) }, 1, 1e-5 },
        { (trip_gaussian[]){ round_at(1e12, 0, 1, 1e12, 1) }, 1, 0.3 },
        { in_a_pixel, MANY, 1e-5 },
        { &needle, 1, 1e-3 },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (int shape = TRIP_GAUSSIAN_PROJECTED; shape <= TRIP_GAUSSIAN_EWA; shape++)
            for (int parallel = 0; parallel < 2; parallel++) {
                const trip_camera c = camera_of(parallel ? 4 : 0);
                trip_gaussian_settings s = { .shape = (trip_gaussian_shape)shape, .depth = true };
                print_message("case %zu, shape %d, %s\n", i, shape,
                              parallel ? "parallel" : "perspective");
                expect_all(&c, &s, cases[i].gaussians, cases[i].count,
                           shape == TRIP_GAUSSIAN_PROJECTED && !parallel ? cases[i].opacity : -1);
            }
}

/* A storage block holds the tiles of a smaller picture. */
static void a_picture_of_several_bands_agrees(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    enum { SIDE = 2100 };
    const trip_camera c = camera_at(trip_v3(0, 0, 0), 0, SIDE, SIDE);
    desk d = open_desk(UINT64_C(1) << 30), cpu = { .budget = d.budget };
    const size_t bytes = 4 * SIDE * SIDE * sizeof(float);
    float *one = malloc(bytes), *other = malloc(bytes);
    assert_non_null(one);
    assert_non_null(other);
    const trip_gaussian_settings s = { .degree = 3 };
    draw(&d, one, NULL, &c, &s, random_scene(c.eye), 300);
    draw(&cpu, other, NULL, &c, &s, random_scene(c.eye), 300);
    assert_true((double)other[4 * (SIDE * (SIDE - 100) + SIDE / 2) + 3] > 0.1);
    assert_true(test_max_apart(one, other, 4 * SIDE * SIDE) < 2.0 / 255);
    free(one);
    free(other);
    close_desk(&d);
}

/* ---- memory, tiles and cancelling ---- */

/* The memory decides how many Gaussians a piece has. */
static void memory_changes_no_bit(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    static float rgba[2][4 * PIXELS], depth[2][PIXELS];
    const trip_camera c = camera_of(0);
    for (int i = 0; i < 2; i++) {
        desk d = open_desk(64u << 20);
        const uint64_t all = trip_budget_left_bytes(d.budget), left = i ? 900 * 1024 : all;
        assert_true(trip_budget_charge(d.budget, all - left));
        draw(&d, rgba[i], depth[i], &c, &full, random_scene(c.eye), SCENE);
        trip_budget_discharge(d.budget, all - left);
        close_desk(&d);
    }
    assert_memory_equal(rgba[0], rgba[1], sizeof rgba[0]);
    assert_memory_equal(depth[0], depth[1], sizeof depth[0]);
}

static void too_little_memory_is_refused_in_a_line(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    const trip_camera c = camera_of(0);
    desk d = open_desk(64u << 20);
    const uint64_t taken = trip_budget_left_bytes(d.budget) - 400 * 1024;
    assert_true(trip_budget_charge(d.budget, taken));
    trip_gaussians_cpu *g;
    const trip_gaussians_cpu_params params = {
        .camera = &c, .settings = &full, .budget = d.budget, .device = d.device
    };
    test_catch_reports();
    assert_int_equal(trip_gaussians_cpu_begin(&g, &params), TRIP_ERROR);
    assert_one_report("150 x 90 px does not fit");
    assert_null(g);
    trip_budget_discharge(d.budget, taken);
    close_desk(&d);
}

/* Three layers of walls close all pixels. The device tells so some pieces later. */
static void closed_tiles_are_told(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    static float rgba[4 * PIXELS];
    const trip_camera c = camera_of(units_high);
    desk d = open_desk(64u << 20);
    trip_gaussian wall = round_at(0, 0, 5, 4000, 1);
    wall.deviations[2] = 0;
    colour(&wall, 1, 1, 1);
    trip_gaussians_cpu *g = begin(&d, &c, &(trip_gaussian_settings){ 0 });
    for (size_t i = 0; i < 4 * d.device->batch_max; i++)
        assert_int_equal(trip_gaussians_cpu_add(g, &wall, 1), 0);
    assert_int_equal(trip_gaussians_cpu_open_tiles(g), 0);
    assert_int_equal(trip_gaussians_cpu_add(g, &wall, 1), 0);
    assert_int_equal(trip_gaussians_cpu_picture(g, rgba, NULL), 0);
    for (int i = 0; i < 4 * PIXELS; i++)
        assert_close((double)rgba[i], 1 - 1e-4, 1e-6);
    trip_gaussians_cpu_end(g);
    close_desk(&d);
}

static void layers_do_not_disturb_each_other(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    static float alone[2][4 * PIXELS], together[4 * PIXELS], depth[PIXELS];
    const trip_camera c[2] = { camera_of(0), camera_of(12) };
    const trip_gaussian *all = random_scene(c->eye);
    desk d = open_desk(64u << 20);
    trip_gaussians_cpu *g[2];
    for (int i = 0; i < 2; i++) {
        draw(&d, alone[i], depth, &c[i], &full, all, SCENE);
        g[i] = begin(&d, &c[i], &full);
    }
    for (int i = 0; i < SCENE; i += 500)
        for (int k = 0; k < 2; k++) {
            assert_int_equal(trip_gaussians_cpu_add(g[k], all + i, 500), 0);
            assert_int_equal(trip_gaussians_cpu_picture(g[k], together, depth), 0);
        }
    for (int i = 0; i < 2; i++) {
        assert_int_equal(trip_gaussians_cpu_picture(g[i], together, depth), 0);
        assert_memory_equal(alone[i], together, sizeof together);
        trip_gaussians_cpu_end(g[i]);
    }
    close_desk(&d);
}

static void a_cancelled_picture_ends_and_the_next_one_is_right(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    static float whole[4 * PIXELS], after[4 * PIXELS], depth[PIXELS];
    const trip_camera c = camera_of(0);
    const trip_gaussian *all = random_scene(c.eye);
    desk d = open_desk(64u << 20);
    draw(&d, whole, depth, &c, &full, all, SCENE);
    trip_scope scope = { 0 };
    trip_scope *before = trip_scope_enter(&scope);
    trip_gaussians_cpu *g = begin(&d, &c, &full);
    test_catch_reports();
    trip_scope_cancel(&scope);
    int status = 0;
    for (int i = 0; i < 20 && !status; i++)
        status = trip_gaussians_cpu_add(g, all, SCENE);
    assert_int_equal(status, TRIP_INTERRUPTED);
    trip_gaussians_cpu_end(g);
    assert_one_report("interrupted");
    trip_scope_enter(before);
    draw(&d, after, depth, &c, &full, all, SCENE);
    assert_memory_equal(whole, after, sizeof whole);
    close_desk(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_gaussian_has_its_opacity_width_and_distance),
        cmocka_unit_test(a_pixel_stops_before_its_transmittance_is_too_small),
        cmocka_unit_test(all_shapes_agree_in_both_projections),
        cmocka_unit_test(clipping_and_opacity_scale_agree),
        cmocka_unit_test(far_coordinates_agree),
        cmocka_unit_test(hard_gaussians_agree),
        cmocka_unit_test(a_picture_of_several_bands_agrees),
        cmocka_unit_test(memory_changes_no_bit),
        cmocka_unit_test(too_little_memory_is_refused_in_a_line),
        cmocka_unit_test(closed_tiles_are_told),
        cmocka_unit_test(layers_do_not_disturb_each_other),
        cmocka_unit_test(a_cancelled_picture_ends_and_the_next_one_is_right),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
