/* The CPU renderer of Gaussian scenes: closed forms, the same bits in all circumstances, and the
 * reference renderer. */
#include "cpu/kernels/isa.h"
#include "gaussian_footprint.h"
#include "gaussians_cpu.h"
#include "gaussians_reference.h"
#include "pool_runner.h"
#include "test.h"

enum { WIDTH = 150, HEIGHT = 90, PIXELS = WIDTH * HEIGHT, SCENE = 3000 };

/* Looks along z from the origin. */
static trip_camera camera_of(double ortho_height)
{
    const trip_camera_params params = { .look = trip_v3(0, 0, 1),
                                        .up = trip_v3(0, 1, 0),
                                        .fov_degrees = 60,
                                        .ortho_height = ortho_height,
                                        .width = WIDTH,
                                        .height = HEIGHT };
    const trip_affine identity = trip_affine_identity();
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &params, &identity), 0);
    return c;
}

/* How a picture is drawn. 0 means one thread, one batch, 64 MB and the widest instruction set. */
typedef struct way {
    unsigned threads;
    size_t batch;
    uint64_t memory_bytes;
    const char *isa;
} way;

typedef struct drawn {
    float rgba[4 * PIXELS], depth[PIXELS];
    size_t open_tiles;
} drawn;

static void draw(drawn *out, const trip_camera *c, const trip_gaussian_settings *s,
                 const trip_gaussian *gaussians, size_t count, way w)
{
    trip_budget *budget;
    trip_cpu_pool *pool;
    trip_gaussians_cpu *g;
    assert_int_equal(trip_budget_create(&budget, w.memory_bytes ? w.memory_bytes : 64u << 20), 0);
    assert_int_equal(trip_cpu_pool_create(&pool, w.threads ? w.threads : 1), 0);
    const trip_task_runner runner = { run_all, pool };
    assert_int_equal(trip_gaussians_cpu_begin(&g, &(trip_gaussians_cpu_params){ .camera = c,
                                                                                .settings = s,
                                                                                .budget = budget,
                                                                                .runner = &runner,
                                                                                .isa = w.isa }),
                     0);
    const size_t batch = w.batch ? w.batch : count;
    for (size_t i = 0; i < count; i += batch)
        assert_int_equal(
            trip_gaussians_cpu_add(g, gaussians + i, batch < count - i ? batch : count - i), 0);
    trip_gaussians_cpu_picture(g, out->rgba, s->depth ? out->depth : NULL);
    out->open_tiles = trip_gaussians_cpu_open_tiles(g);
    trip_gaussians_cpu_end(g);
    trip_cpu_pool_destroy(pool);
    assert_true(trip_budget_left_bytes(budget) == trip_budget_limit_bytes(budget));
    trip_budget_destroy(budget);
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
static void colour(trip_gaussian *g, double r, double gr, double b)
{
    const double sh0 = sqrt(4 * 3.14159265358979323846);
    g->sh[0][0] = (float)((r - 0.5) * sh0);
    g->sh[0][1] = (float)((gr - 0.5) * sh0);
    g->sh[0][2] = (float)((b - 0.5) * sh0);
}

static int nearer(const void *a, const void *b)
{
    const double x = ((const trip_gaussian *)a)->centre[2],
                 y = ((const trip_gaussian *)b)->centre[2];
    return (x > y) - (x < y);
}

/* A repeatable scene in order of depth: many small Gaussians, some long and thin, some very large,
 * some opaque, some near the eye. */
static const trip_gaussian *random_scene(void)
{
    static trip_gaussian scene[SCENE];
    if (scene[0].opacity > 0)
        return scene;
    for (int i = 0; i < SCENE; i++) {
        trip_gaussian *g = &scene[i];
        const double z = 0.1 + 20 * test_random(), size = i % 200 == 0 ? 3 : 0.15;
        *g = round_at(z * (2 * test_random() - 1), z * (2 * test_random() - 1), z, 0,
                      i % 3 ? test_random() : 1);
        double length = 0;
        for (int k = 0; k < 4; k++) {
            g->rotation[k] = (float)(2 * test_random() - 1);
            length += (double)(g->rotation[k] * g->rotation[k]);
        }
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
    qsort(scene, SCENE, sizeof *scene, nearer);
    return scene;
}

static const float *pixel(const drawn *d, int x, int y)
{
    return d->rgba + 4 * (y * WIDTH + x);
}

static drawn one, other;

static void a_gaussian_has_its_opacity_and_width(void **state)
{
    (void)state;
    const trip_camera c =
        camera_of(9); /* 10 px per unit; the centre of pixel (75, 45) is at 75.5 */
    trip_gaussian g = round_at(-0.05, -0.05, 5, 0.4, 0.8);
    colour(&g, 1, 0.5, 0.25);
    draw(&one, &c, &(trip_gaussian_settings){ .degree = 0 }, &g, 1, (way){ 0 });
    const float *centre = pixel(&one, 75, 45);
    assert_close((double)centre[3], 0.8, 1e-6);
    assert_close((double)centre[0], 0.8, 1e-6);
    assert_close((double)centre[1], 0.4, 1e-6);
    assert_close((double)centre[2], 0.2, 1e-6);
    for (int d = 1; d < 20; d++) {
        double alpha = 0.8 * exp(-0.5 * d * d / (16 + 0.3));
        alpha = alpha >= 1.0 / 255 ? alpha : 0;
        assert_close((double)pixel(&one, 75 + d, 45)[3], alpha, 1e-6);
        assert_close((double)pixel(&one, 75 - d, 45)[3], alpha, 1e-6);
        assert_close((double)pixel(&one, 75, 45 + d)[3], alpha, 1e-6);
    }
}

static void the_first_gaussian_is_in_front(void **state)
{
    (void)state;
    const trip_camera c = camera_of(9);
    trip_gaussian g[2] = { round_at(-0.05, -0.05, 8, 0.4, 0.75),
                           round_at(-0.05, -0.05, 5, 0.4, 0.5) };
    colour(&g[0], 1, 0, 0);
    colour(&g[1], 0, 1, 0);
    const trip_gaussian_settings s = { .background = { 0, 0, 1, 0.5 }, .depth = true };
    draw(&one, &c, &s, g, 2, (way){ 0 });
    const float *p = pixel(&one, 75, 45);
    assert_close((double)p[0], 0.75, 1e-6);
    assert_close((double)p[1], 0.25 * 0.5, 1e-6);
    assert_close((double)p[2], 0.125 * 0.5, 1e-6);
    assert_close((double)p[3], 0.875 + 0.125 * 0.5, 1e-6);
    assert_close((double)one.depth[45 * WIDTH + 75], (0.75 * 8 + 0.125 * 5) / 0.875, 1e-5);
    assert_true(isinf(one.depth[0]));
    assert_close((double)pixel(&one, 0, 0)[3], 0.5, 1e-6);
}

static void alpha_has_a_maximum_and_colours_have_none(void **state)
{
    (void)state;
    const trip_camera c = camera_of(9);
    trip_gaussian g = round_at(-0.05, -0.05, 5, 0.4, 1);
    colour(&g, 3, -2, 0);
    draw(&one, &c, &(trip_gaussian_settings){ 0 }, &g, 1, (way){ 0 });
    assert_close((double)pixel(&one, 75, 45)[3], 0.99, 1e-6);
    assert_close((double)pixel(&one, 75, 45)[0], 2.97, 1e-5);
    assert_close((double)pixel(&one, 75, 45)[1], 0, 0);
}

/* The transmittance after two Gaussians is 1e-4, which is not below 1e-4. After the third it would
 * be 1e-6, so the third and all later ones are left out, faint ones too. */
static void a_pixel_stops_before_its_transmittance_is_too_small(void **state)
{
    (void)state;
    const trip_camera c = camera_of(9);
    trip_gaussian g[4];
    for (int i = 0; i < 4; i++) {
        g[i] = round_at(-0.05, -0.05, 5 + i, 0.4, i < 3 ? 1 : 0.1);
        colour(&g[i], i == 1, i == 2, i == 3);
    }
    draw(&one, &c, &(trip_gaussian_settings){ 0 }, g, 4, (way){ 0 });
    const float *p = pixel(&one, 75, 45);
    assert_close((double)p[3], 1 - 1e-4, 1e-7);
    assert_close((double)p[0], 0.01 * 0.99, 1e-7);
    assert_close((double)p[1], 0, 0);
    assert_close((double)p[2], 0, 0);
}

static void closed_tiles_are_told_and_take_nothing(void **state)
{
    (void)state;
    const trip_camera c = camera_of(9);
    trip_budget *budget;
    trip_gaussians_cpu *g;
    const trip_gaussian_settings s = { 0 };
    assert_int_equal(trip_budget_create(&budget, 64u << 20), 0);
    assert_int_equal(
        trip_gaussians_cpu_begin(
            &g, &(trip_gaussians_cpu_params){ .camera = &c, .settings = &s, .budget = budget }),
        0);
    assert_int_equal(trip_gaussians_cpu_open_tiles(g), 10 * 6);
    /* A wall that closes the pixels within 57 px of its centre, the middle of the left edge. */
    trip_gaussian wall[3];
    for (int i = 0; i < 3; i++) {
        wall[i] = round_at(7.5, 0, 5, 40, 1);
        wall[i].deviations[2] = 0;
    }
    assert_int_equal(trip_gaussians_cpu_add(g, wall, 3), 0);
    const size_t open = trip_gaussians_cpu_open_tiles(g);
    assert_true(open < 60);
    assert_false(trip_gaussians_cpu_is_open(g, (double[]){ 10, 40 }, (double[]){ 14, 47 }));
    assert_false(trip_gaussians_cpu_is_open(g, (double[]){ -90, 20 }, (double[]){ -10, 60 }));
    assert_int_equal(
        trip_gaussians_cpu_is_open(g, (double[]){ -1e9, -1e9 }, (double[]){ 1e9, 1e9 }), open > 0);
    const trip_gaussian behind = round_at(6.3, 0, 9, 0.1, 0.5);
    const uint64_t before = trip_gaussians_cpu_get_stats(g).drawn;
    assert_int_equal(trip_gaussians_cpu_add(g, &behind, 1), 0);
    assert_int_equal(trip_gaussians_cpu_get_stats(g).drawn, before);
    trip_gaussians_cpu_end(g);
    trip_budget_destroy(budget);
}

static const trip_gaussian_settings full = {
    .degree = 3, .antialiased = true, .background = { 0.2, 0.4, 0.6, 0.9 }, .depth = true
};

static const trip_gaussian_settings exact = {
    .degree = 3, .shape = TRIP_GAUSSIAN_EXACT, .background = { 0.2, 0.4, 0.6, 0.9 }, .depth = true
};

static void expect_same(way w)
{
    const trip_camera c = camera_of(0);
    for (int i = 0; i < 2; i++) {
        const trip_gaussian_settings *s = i ? &exact : &full;
        draw(&one, &c, s, random_scene(), SCENE, (way){ 0 });
        draw(&other, &c, s, random_scene(), SCENE, w);
        assert_memory_equal(one.rgba, other.rgba, sizeof one.rgba);
        assert_memory_equal(one.depth, other.depth, sizeof one.depth);
        assert_int_equal(one.open_tiles, other.open_tiles);
    }
}

static void threads_change_no_bit(void **state)
{
    (void)state;
    expect_same((way){ .threads = 2 });
    expect_same((way){ .threads = 5 });
}

static void batches_change_no_bit(void **state)
{
    (void)state;
    expect_same((way){ .batch = 1 });
    expect_same((way){ .batch = 700 });
}

/* Moves a Gaussian until its footprint ends just left of a pixel centre. */
static void end_before(trip_gaussian *g, const trip_camera *c, const trip_gaussian_settings *s,
                       double pixel_centre)
{
    const double wanted = pixel_centre - 1e-8;
    for (int step = 0; step < 60; step++) {
        trip_gaussian_footprint f = { 0 };
        assert_true(trip_gaussian_footprint_of(c, s, g, &f));
        g->centre[0] -= (wanted - f.hi[0]) / 10; /* 10 px per unit, and x goes left */
    }
}

/* Rounding lets the first pixel behind a footprint have an alpha of 1/255. Its tile may not take
 * it: drawn alone, a Gaussian is left out if the tiles of its footprint are closed. */
static void footprints_keep_to_their_tiles(void **state)
{
    (void)state;
    enum { ENDING = 400, WALL = 3 };
    static trip_gaussian scene[WALL + ENDING];
    const trip_camera c = camera_of(9);
    const trip_gaussian_settings s = { .background = { 0, 0, 0, 1 } };
    /* Pixels within 30.83 px of x = 17.17 px get three times an alpha above 0.9536. This closes the
     * columns up to 47.5 px, and with them the first three tiles of each row. */
    for (int i = 0; i < WALL; i++) {
        scene[i] = round_at(5.783, 0, 5, 10, 1);
        scene[i].deviations[1] = 1000;
        scene[i].deviations[2] = 0;
    }
    for (int i = 0; i < ENDING; i++) {
        trip_gaussian *g = &scene[WALL + i];
        *g = round_at(3, 8 * test_random() - 4, 9, 0.4 + 0.2 * test_random(),
                      0.2 + 0.7 * test_random());
        colour(g, 1, 1, 1);
        end_before(g, &c, &s, 48.5);
    }
    draw(&one, &c, &s, scene, WALL + ENDING, (way){ 0 });
    draw(&other, &c, &s, scene, WALL + ENDING, (way){ .batch = 1 });
    assert_memory_equal(one.rgba, other.rgba, sizeof one.rgba);
}

static void memory_changes_no_bit(void **state)
{
    (void)state;
    expect_same((way){ .memory_bytes = 600 * 1024, .threads = 2 });
}

static void instruction_sets_change_no_bit(void **state)
{
    (void)state;
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++)
        expect_same((way){ .isa = (*isa)->isa });
}

static void too_little_memory_is_refused_in_a_line(void **state)
{
    (void)state;
    const trip_camera c = camera_of(0);
    trip_budget *budget;
    trip_gaussians_cpu *g;
    trip_gaussians_reference *r;
    assert_int_equal(trip_budget_create(&budget, 200 * 1024), 0);
    test_catch_reports();
    assert_int_equal(
        trip_gaussians_cpu_begin(
            &g, &(trip_gaussians_cpu_params){ .camera = &c, .settings = &full, .budget = budget }),
        TRIP_ERROR);
    assert_one_report("150 x 90 px does not fit");
    assert_null(g);
    test_catch_reports();
    assert_int_equal(trip_gaussians_reference_begin(&r, &c, &full, budget), TRIP_ERROR);
    assert_one_report("150 x 90 px does not fit");
    assert_null(r);
    assert_true(trip_budget_left_bytes(budget) == trip_budget_limit_bytes(budget));
    trip_budget_destroy(budget);
}

/* A pixel may lie on the other side of a bound of alpha by rounding, which changes it by 1/255 of a
 * colour. */
static void expect_the_reference(const trip_camera *c, const trip_gaussian_settings *s)
{
    trip_budget *budget;
    trip_gaussians_reference *r;
    assert_int_equal(trip_budget_create(&budget, 64u << 20), 0);
    assert_int_equal(trip_gaussians_reference_begin(&r, c, s, budget), 0);
    assert_int_equal(trip_gaussians_reference_add(r, random_scene(), SCENE), 0);
    trip_gaussians_reference_picture(r, other.rgba, s->depth ? other.depth : NULL);
    trip_gaussians_reference_end(r);
    trip_budget_destroy(budget);
    draw(&one, c, s, random_scene(), SCENE, (way){ 0 });
    double sum = 0, opacity = 0;
    for (int i = 0; i < 4 * PIXELS; i++) {
        sum += fabs((double)one.rgba[i] - (double)other.rgba[i]);
        opacity += i % 4 == 3 ? (double)other.rgba[i] : 0;
    }
    assert_true(opacity / PIXELS > 0.1);
    assert_true(sum / (4 * PIXELS) < 0.01 / 255);
    assert_true(test_max_apart(one.rgba, other.rgba, 4 * PIXELS) < 2.0 / 255);
    for (int i = 0; s->depth && i < PIXELS; i++)
        if (isfinite(other.depth[i]))
            assert_close((double)one.depth[i], (double)other.depth[i], 0.02);
}

static void perspective_agrees_with_the_reference(void **state)
{
    (void)state;
    const trip_camera c = camera_of(0);
    expect_the_reference(&c, &full);
    expect_the_reference(&c, &(trip_gaussian_settings){ .degree = 2, .opacity_scale = 0.3 });
}

static void parallel_views_agree_with_the_reference(void **state)
{
    (void)state;
    const trip_camera c = camera_of(12);
    expect_the_reference(&c, &full);
    trip_gaussian_settings s = { .degree = 1, .early_termination = 0.02 };
    trip_clip_add(&s.clip, trip_v3(0, 0.6, 0.8), -4);
    expect_the_reference(&c, &s);
}

static void exact_footprints_agree_with_the_reference(void **state)
{
    (void)state;
    const trip_camera c = camera_of(0), parallel = camera_of(12);
    expect_the_reference(&c, &exact);
    expect_the_reference(&parallel, &exact);
}

/* Draws the Gaussians of each box of a grid alone. Returns the number of boxes that are not needed,
 * and checks that they draw nothing. */
static int boxes_without_need(const trip_camera *c, const trip_gaussian_settings *s)
{
    enum { CELLS = 7 };
    static trip_gaussian inside[SCENE];
    const trip_gaussian *scene = random_scene();
    int without = 0;
    for (int cell = 0; cell < CELLS * CELLS * CELLS; cell++) {
        double lo[3], hi[3], deviation = 0;
        size_t count = 0;
        for (int k = 0; k < 3; k++) {
            const int at = k == 0   ? cell % CELLS
                           : k == 1 ? cell / CELLS % CELLS
                                    : cell / CELLS / CELLS;
            lo[k] = k < 2 ? -20 + 40.0 * at / CELLS : 21.0 * at / CELLS;
            hi[k] = lo[k] + (k < 2 ? 40.0 : 21.0) / CELLS;
        }
        for (int i = 0; i < SCENE; i++) {
            const trip_gaussian *g = &scene[i];
            bool in = true;
            for (int k = 0; k < 3; k++)
                in &= g->centre[k] >= lo[k] && g->centre[k] <= hi[k];
            for (int k = 0; k < 3 && in; k++)
                deviation = fmax(deviation, (double)g->deviations[k]);
            if (in)
                inside[count++] = *g;
        }
        trip_budget *budget;
        trip_gaussians_cpu *g;
        assert_int_equal(trip_budget_create(&budget, 2u << 20), 0);
        assert_int_equal(
            trip_gaussians_cpu_begin(
                &g, &(trip_gaussians_cpu_params){ .camera = c, .settings = s, .budget = budget }),
            0);
        const bool needed = trip_gaussians_cpu_needs_box(g, lo, hi, deviation);
        assert_int_equal(trip_gaussians_cpu_add(g, inside, count), 0);
        if (!needed)
            assert_int_equal(trip_gaussians_cpu_get_stats(g).drawn, 0);
        without += !needed && count > 0;
        trip_gaussians_cpu_end(g);
        trip_budget_destroy(budget);
    }
    return without;
}

static void boxes_that_are_not_needed_draw_nothing(void **state)
{
    (void)state;
    const trip_camera c = camera_of(0), parallel = camera_of(3);
    assert_true(boxes_without_need(&c, &full) > 10);
    assert_true(boxes_without_need(&parallel, &full) > 50);
    assert_int_equal(boxes_without_need(&c, &exact), 0);
    assert_true(boxes_without_need(&parallel, &exact) > 50);
}

/* One unusable number must not reach other pixels of a vector. */
static void unusable_colours_stay_in_their_pixels(void **state)
{
    (void)state;
    const trip_camera c = camera_of(9);
    trip_gaussian g = round_at(-0.05, -0.05, 5, 0.2, 0.5);
    for (int i = 0; i < TRIP_SH_MAX; i++)
        for (int channel = 0; channel < 3; channel++)
            g.sh[i][channel] = channel == 0 ? INFINITY : channel == 1 ? -INFINITY : NAN;
    draw(&one, &c, &(trip_gaussian_settings){ .degree = 0 }, &g, 1, (way){ 0 });
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            for (int k = 0; k < 4; k++) {
                assert_true(isfinite(pixel(&one, x, y)[k]));
                if (hypot(x - 75, y - 45) > 8)
                    assert_close((double)pixel(&one, x, y)[k], 0, 0);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_gaussian_has_its_opacity_and_width),
        cmocka_unit_test(the_first_gaussian_is_in_front),
        cmocka_unit_test(alpha_has_a_maximum_and_colours_have_none),
        cmocka_unit_test(a_pixel_stops_before_its_transmittance_is_too_small),
        cmocka_unit_test(closed_tiles_are_told_and_take_nothing),
        cmocka_unit_test(threads_change_no_bit),
        cmocka_unit_test(batches_change_no_bit),
        cmocka_unit_test(footprints_keep_to_their_tiles),
        cmocka_unit_test(memory_changes_no_bit),
        cmocka_unit_test(instruction_sets_change_no_bit),
        cmocka_unit_test(too_little_memory_is_refused_in_a_line),
        cmocka_unit_test(perspective_agrees_with_the_reference),
        cmocka_unit_test(parallel_views_agree_with_the_reference),
        cmocka_unit_test(exact_footprints_agree_with_the_reference),
        cmocka_unit_test(boxes_that_are_not_needed_draw_nothing),
        cmocka_unit_test(unusable_colours_stay_in_their_pixels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
