/* The deferred picture of surfels: closed forms, the same bits in all circumstances, and the
 * reference renderer. */
#include "pool_runner.h"
#include "surfel_scenes.h"
#include "surfels_cpu.h"
#include "surfels_reference.h"
#include "test.h"

/* How a picture is drawn. 0 means one thread, one batch in order, and 64 MB. */
typedef struct way {
    unsigned threads;
    size_t batch;
    bool backwards; /* the last batch comes first */
    uint64_t memory_bytes;
    bool unselected;
} way;

typedef struct drawn {
    float rgba[4 * SURFEL_PIXELS], depth[SURFEL_PIXELS];
    trip_surfels_cpu_stats stats;
} drawn;

static void add_all(trip_surfels_cpu *s, const trip_gaussian *surfels, size_t count, way w)
{
    const size_t batch = w.batch ? w.batch : count, batches = (count + batch - 1) / batch;
    for (size_t i = 0; i < batches; i++) {
        const size_t from = (w.backwards ? batches - 1 - i : i) * batch;
        const size_t some = batch < count - from ? batch : count - from;
        assert_int_equal(trip_surfels_cpu_add(s, surfels + from, some, (uint32_t)from), 0);
    }
}

static uint32_t get(const void *context, size_t i, trip_gaussian *out)
{
    *out = ((const trip_gaussian *)context)[i];
    return (uint32_t)i;
}

static void draw(drawn *out, const trip_camera *c, const trip_gaussian_settings *settings,
                 const trip_gaussian *surfels, size_t count, way w)
{
    trip_budget *budget;
    trip_cpu_pool *pool;
    trip_surfels_cpu *s;
    assert_int_equal(trip_budget_create(&budget, w.memory_bytes ? w.memory_bytes : 64u << 20), 0);
    assert_int_equal(trip_cpu_pool_create(&pool, w.threads ? w.threads : 1), 0);
    const trip_task_runner runner = { run_all, pool };
    const trip_surfels_cpu_params params = { .camera = c,
                                             .settings = settings,
                                             .budget = budget,
                                             .runner = &runner,
                                             .unselected = w.unselected };
    assert_int_equal(trip_surfels_cpu_begin(&s, &params), 0);
    add_all(s, surfels, count, w);
    if (w.unselected)
        assert_int_equal(trip_surfels_cpu_blend_from(s, get, surfels, count), 0);
    assert_int_equal(trip_surfels_cpu_picture(s, out->rgba, settings->depth ? out->depth : NULL),
                     0);
    out->stats = trip_surfels_cpu_get_stats(s);
    trip_surfels_cpu_end(s);
    trip_cpu_pool_destroy(pool);
    assert_true(trip_budget_left_bytes(budget) == trip_budget_limit_bytes(budget));
    trip_budget_destroy(budget);
}

static void draw_reference(drawn *out, const trip_camera *c, const trip_gaussian_settings *settings,
                           const trip_gaussian *surfels, size_t count)
{
    trip_budget *budget;
    trip_surfels_reference *r;
    assert_int_equal(trip_budget_create(&budget, 64u << 20), 0);
    assert_int_equal(trip_surfels_reference_begin(&r, c, settings, budget), 0);
    assert_int_equal(trip_surfels_reference_add(r, surfels, count, 0), 0);
    trip_surfels_reference_picture(r, out->rgba, settings->depth ? out->depth : NULL);
    trip_surfels_reference_end(r);
    assert_true(trip_budget_left_bytes(budget) == trip_budget_limit_bytes(budget));
    trip_budget_destroy(budget);
}

static const float *pixel(const drawn *d, int x, int y)
{
    return d->rgba + 4 * (y * SURFEL_WIDTH + x);
}

static drawn one, other;
static trip_gaussian surfels[4 * SURFEL_SIDE * SURFEL_SIDE];
static const trip_gaussian_settings plain = { .depth = true };

static void expect_pixel(const drawn *d, int x, int y, const double rgba[4], double tolerance)
{
    for (int k = 0; k < 4; k++)
        assert_close((double)pixel(d, x, y)[k], rgba[k], tolerance);
}

/* ---- closed forms ---- */

static void a_disc_has_its_radius_and_an_edge_of_a_pixel(void **state)
{
    (void)state;
    const trip_camera c =
        surfel_camera(9); /* 10 px per unit; the centre of pixel (75, 45) is at 75.5 */
    trip_gaussian g = surfel_at(-0.05, -0.05, 5, 2, 0);
    const double radius = sqrt(2 * log(2) * (1.5 * 1.5 * 17 * 17 + 0.4));
    surfel_colour(&g, 0.25, 0.5, 1);
    draw(&one, &c, &plain, &g, 1, (way){ 0 });
    for (int d = 0; d < 40; d++) {
        const double a = fmax(0, fmin(1, radius - d));
        const double rgba[4] = { 0.25 * a, 0.5 * a, a, a };
        expect_pixel(&one, 75 + d, 45, rgba, 1e-4);
        expect_pixel(&one, 75 - d, 45, rgba, 1e-4);
        expect_pixel(&one, 75, 45 + d, rgba, 1e-4);
        if (a > 0)
            assert_close((double)one.depth[45 * SURFEL_WIDTH + 75 + d], 5, 1e-6);
        else
            assert_true(isinf(one.depth[45 * SURFEL_WIDTH + 75 + d]));
    }
    assert_int_equal(one.stats.visible, 1);
}

/* A square of points with equal colours is a plane without holes, wherever the eye is. Each pixel
 * has the depth at which its ray meets the plane, or at which a ray a pixel away meets it. */
static void a_plane_is_closed_and_has_its_colour_and_depth(void **state)
{
    (void)state;
    static const double angles[] = { 0, 0.5, 1, 1.3, 1.5 }, distances[] = { 0.02, 0.3, 1 };
    const trip_gaussian_settings settings = { .depth = true, .background = { 1, 0, 0, 1 } };
    int seen = 0;
    for (int ortho = 0; ortho < 2; ortho++)
        for (size_t i = 0; i < sizeof angles / sizeof *angles * 3; i++) {
            const double angle = angles[i / 3], distance = distances[i % 3];
            const trip_camera c = surfel_camera(ortho ? 9 : 0);
            surfel_plane(surfels, 5, distance, angle);
            for (int k = 0; k < SURFEL_SIDE * SURFEL_SIDE; k++)
                surfel_colour(&surfels[k], 0.25, 0.5, 0.75);
            draw(&one, &c, &settings, surfels, SURFEL_SIDE * SURFEL_SIDE, (way){ 0 });
            for (int at = 0; at < SURFEL_PIXELS; at++) {
                const trip_vec3 ray =
                    trip_camera_ray(&c, at % SURFEL_WIDTH + 0.5, at / SURFEL_WIDTH + 0.5);
                const trip_vec3 across = trip_add(trip_scale(c.rx, at % SURFEL_WIDTH + 0.5),
                                                  trip_scale(c.ry, at / SURFEL_WIDTH + 0.5));
                const trip_vec3 from = ortho ? trip_add(c.eye, across) : c.eye;
                const trip_vec3 normal = trip_v3(0, -sin(angle), cos(angle));
                const double z =
                    trip_dot(normal, trip_sub(trip_v3(0, 0, 5), from)) / trip_dot(normal, ray);
                const trip_vec3 p = trip_add(from, trip_scale(ray, z));
                const double inside = (SURFEL_SIDE / 2 - 2) * distance;
                const double edge = 3 * trip_length(ortho ? c.rx : trip_scale(c.rx, z));
                if (!(z > 2 * distance && fabs(p.x) < inside - edge &&
                      fabs(p.y) < inside * cos(angle) - edge))
                    continue;
                seen++;
                expect_pixel(&one, at % SURFEL_WIDTH, at / SURFEL_WIDTH,
                             (double[]){ 0.25, 0.5, 0.75, 1 }, 1e-5);
                assert_close((double)one.depth[at], z * trip_length(ray),
                             0.1 * distance / cos(angle) + 0.4 * edge * tan(angle));
            }
        }
    assert_true(seen > 10 * SURFEL_PIXELS);
}

static void surfels_beyond_the_border_reach_the_picture(void **state)
{
    (void)state;
    const trip_camera c = surfel_camera(9);
    /* A disc of 100 px beside each corner and each side covers the whole picture. A small disc lies
     * between the left one and the picture, in front of it. */
    int count = 0;
    for (int x = -1; x <= 1; x++)
        for (int y = -1; y <= 1; y++)
            if (x || y)
                surfels[count++] = surfel_at(13.5 * x, 6 * y, 30, 10, 0);
    surfels[count++] = surfel_at(8.3, 0, 18, 0.5, 0);
    draw(&one, &c, &plain, surfels, (size_t)count, (way){ 0 });
    for (int at = 0; at < SURFEL_PIXELS; at++)
        expect_pixel(&one, at % SURFEL_WIDTH, at / SURFEL_WIDTH, (double[]){ 1, 1, 1, 1 }, 1e-6);
    assert_int_equal(one.stats.visible, 9);
}

static void far_points_never_get_lost(void **state)
{
    (void)state;
    const trip_camera c = surfel_camera(9);
    for (int i = 0; i < 200; i++) {
        const double x = 12 * test_random() - 6, y = 8 * test_random() - 4;
        trip_gaussian g = surfel_at(x, y, 5, 1e-4, 0);
        draw(&one, &c, &plain, &g, 1, (way){ 0 });
        double sum = 0;
        for (int at = 0; at < SURFEL_PIXELS; at++)
            sum += (double)one.rgba[4 * at + 3];
        assert_true(sum > 0.1 && sum < 1.2);
        const int column = (int)floor(SURFEL_WIDTH / 2.0 - 10 * x),
                  row = (int)floor(SURFEL_HEIGHT / 2.0 - 10 * y);
        assert_true(isfinite(one.depth[row * SURFEL_WIDTH + column]));
    }
}

/* ---- several surfaces ---- */

static void only_the_front_plane_is_seen(void **state)
{
    (void)state;
    const trip_camera c = surfel_camera(0);
    surfel_plane(surfels, 5, 0.1, 0.3);
    surfel_plane(surfels + SURFEL_SIDE * SURFEL_SIDE, 5.3, 0.1, 0.3);
    for (int k = 0; k < SURFEL_SIDE * SURFEL_SIDE; k++)
        surfel_colour(&surfels[SURFEL_SIDE * SURFEL_SIDE + k], 1, 0, 0);
    draw(&one, &c, &plain, surfels, SURFEL_SIDE * SURFEL_SIDE, (way){ 0 });
    draw(&other, &c, &plain, surfels, 2 * SURFEL_SIDE * SURFEL_SIDE, (way){ 0 });
    assert_memory_equal(one.rgba, other.rgba, sizeof one.rgba);
    assert_memory_equal(one.depth, other.depth, sizeof one.depth);
}

/* Two noisy scans of one surface, closer than the tolerance, count as one surface of both
 * colours. */
static void scans_of_one_surface_blend(void **state)
{
    (void)state;
    const trip_camera c = surfel_camera(9);
    double red = 0, green = 0;
    surfel_plane(surfels, 5, 0.3, 0);
    surfel_plane(surfels + SURFEL_SIDE * SURFEL_SIDE, 5, 0.3, 0);
    for (int k = 0; k < 2 * SURFEL_SIDE * SURFEL_SIDE; k++) {
        trip_gaussian *g = &surfels[k];
        g->centre[0] += k < SURFEL_SIDE * SURFEL_SIDE ? 0 : 0.15;
        g->centre[2] += 0.4 * g->deviations[0] * (test_random() - 0.5);
        surfel_colour(g, k < SURFEL_SIDE * SURFEL_SIDE, k >= SURFEL_SIDE * SURFEL_SIDE, 0);
    }
    draw(&one, &c, &plain, surfels, 2 * SURFEL_SIDE * SURFEL_SIDE, (way){ 0 });
    for (int at = 0; at < SURFEL_PIXELS; at++) {
        const float *p = one.rgba + 4 * at;
        assert_close((double)p[0] + (double)p[1], 1, 1e-5);
        assert_true((double)p[0] > 0.1 && (double)p[1] > 0.1);
        red += (double)p[0] / SURFEL_PIXELS;
        green += (double)p[1] / SURFEL_PIXELS;
    }
    assert_close(red, 0.5, 0.02);
    assert_close(green, 0.5, 0.02);
}

/* Where a front disc ends, its last pixel shows the plane behind, and not the background. */
static void an_edge_shows_the_surface_behind_it(void **state)
{
    (void)state;
    const trip_camera c = surfel_camera(9);
    const trip_gaussian_settings settings = { .background = { 0, 0, 1, 1 } };
    surfel_plane(surfels, 9, 0.3, 0);
    surfels[SURFEL_SIDE * SURFEL_SIDE] = surfel_at(-0.05, -0.05, 5, 2, 0);
    for (int k = 0; k <= SURFEL_SIDE * SURFEL_SIDE; k++)
        surfel_colour(&surfels[k], k == SURFEL_SIDE * SURFEL_SIDE, k < SURFEL_SIDE * SURFEL_SIDE,
                      0);
    const double radius = sqrt(2 * log(2) * (1.5 * 1.5 * 17 * 17 + 0.4));
    draw(&one, &c, &settings, surfels, SURFEL_SIDE * SURFEL_SIDE + 1, (way){ 0 });
    for (int d = 0; d < 40; d++) {
        const double a = fmax(0, fmin(1, radius - d));
        expect_pixel(&one, 75 + d, 45, (double[]){ a, 1 - a, 0, 1 }, 1e-4);
    }
}

/* A disc of 5 px loses its only cell to a point before it, and hides the plane behind it. Its
 * pixels get colours from pixels farther away. */
static void a_disc_that_lost_its_cell_leaves_no_hole(void **state)
{
    (void)state;
    const trip_camera c = surfel_camera(9);
    surfel_plane(surfels, 9, 0.3, 0);
    surfels[SURFEL_SIDE * SURFEL_SIDE] = surfel_at(-0.05, -0.05, 5, 0.3, 0);
    surfels[SURFEL_SIDE * SURFEL_SIDE + 1] = surfel_at(-0.05, -0.05, 4, 1e-4, 0);
    draw(&one, &c, &plain, surfels, SURFEL_SIDE * SURFEL_SIDE + 2, (way){ 0 });
    draw_reference(&other, &c, &plain, surfels, SURFEL_SIDE * SURFEL_SIDE + 2);
    int hidden = 0;
    for (int at = 0; at < SURFEL_PIXELS; at++) {
        assert_close((double)one.rgba[4 * at + 3], 1, 1e-6);
        assert_close((double)other.rgba[4 * at + 3], 1, 1e-6);
        hidden += fabs((double)one.depth[at] - 5) < 0.1;
    }
    assert_in_range(hidden, 25, 100); /* a circle of 4.6 px without its centre */
}

/* ---- the reference, and the same bits ---- */

static void cpu_draws_the_reference(void **state)
{
    (void)state;
    for (int ortho = 0; ortho < 2; ortho++) {
        const trip_camera c = surfel_camera(ortho ? 20 : 0);
        int apart = 0;
        draw(&one, &c, &surfel_full, surfel_scene(), SURFEL_SCENE, (way){ 0 });
        draw_reference(&other, &c, &surfel_full, surfel_scene(), SURFEL_SCENE);
        for (int at = 0; at < SURFEL_PIXELS; at++) {
            const bool far = test_max_apart(one.rgba + 4 * at, other.rgba + 4 * at, 4) > 1e-3;
            const double a = (double)one.depth[at], b = (double)other.depth[at];
            apart += far || isinf(a) != isinf(b) || (isfinite(a) && fabs(a - b) > 1e-4 * b);
        }
        /* Rounding decides rarely whether a surfel covers a pixel, or lies within a tolerance. */
        assert_in_range(apart, 0, SURFEL_PIXELS / 500);
    }
}

static void expect_same(way w)
{
    for (int ortho = 0; ortho < 2; ortho++) {
        const trip_camera c = surfel_camera(ortho ? 20 : 0);
        draw(&one, &c, &surfel_full, surfel_scene(), SURFEL_SCENE, (way){ 0 });
        draw(&other, &c, &surfel_full, surfel_scene(), SURFEL_SCENE, w);
        assert_memory_equal(one.rgba, other.rgba, sizeof one.rgba);
        assert_memory_equal(one.depth, other.depth, sizeof one.depth);
        assert_int_equal(one.stats.visible, other.stats.visible);
        assert_int_equal(one.stats.hidden, 0); /* all in one batch */
        assert_true(!w.batch || other.stats.hidden > 0);
    }
}

static void threads_change_no_bit(void **state)
{
    (void)state;
    expect_same((way){ .threads = 2 });
    expect_same((way){ .threads = 5 });
}

static void order_and_batches_change_no_bit(void **state)
{
    (void)state;
    expect_same((way){ .batch = 1 });
    expect_same((way){ .batch = 1, .backwards = true });
    expect_same((way){ .batch = 700, .backwards = true, .threads = 3 });
}

/* Selection keeps all surfels if each has a pixel of its own and none is hidden. */
static void selection_keeps_all_surfels_that_can_be_told_apart(void **state)
{
    (void)state;
    const trip_camera c = surfel_camera(0);
    surfel_plane(surfels, 5, 0.3, 0.4);
    for (int k = 0; k < SURFEL_SIDE * SURFEL_SIDE; k++)
        surfel_colour(&surfels[k], test_random(), test_random(), test_random());
    draw(&one, &c, &plain, surfels, SURFEL_SIDE * SURFEL_SIDE, (way){ .threads = 2 });
    draw(&other, &c, &plain, surfels, SURFEL_SIDE * SURFEL_SIDE,
         (way){ .threads = 2, .unselected = true });
    assert_true(one.stats.visible > 100);
    assert_true(other.stats.hidden == 0);
    for (int i = 0; i < 4 * SURFEL_PIXELS; i++)
        assert_close((double)one.rgba[i], (double)other.rgba[i], 1e-4);
    assert_memory_equal(one.depth, other.depth, sizeof one.depth);
}

/* Two scans of a surface, with noise about as large as the tolerance. */
static void hidden_surfels_of_noisy_scans_change_no_bit(void **state)
{
    (void)state;
    const trip_camera c = surfel_camera(0);
    surfel_plane(surfels, 5, 0.05, 0.5);
    surfel_plane(surfels + SURFEL_SIDE * SURFEL_SIDE, 5.02, 0.05, 0.5);
    for (int k = 0; k < 2 * SURFEL_SIDE * SURFEL_SIDE; k++) {
        surfels[k].centre[2] += 0.4 * (test_random() - 0.5);
        surfel_colour(&surfels[k], test_random(), test_random(), test_random());
    }
    draw(&one, &c, &surfel_full, surfels, 2 * SURFEL_SIDE * SURFEL_SIDE, (way){ 0 });
    draw(&other, &c, &surfel_full, surfels, 2 * SURFEL_SIDE * SURFEL_SIDE,
         (way){ .batch = 900, .backwards = true });
    assert_memory_equal(one.rgba, other.rgba, sizeof one.rgba);
    assert_memory_equal(one.depth, other.depth, sizeof one.depth);
    assert_true(other.stats.hidden > 300);
}

static void memory_changes_no_bit(void **state)
{
    (void)state;
    expect_same((way){ .memory_bytes = 4000 * 1024, .batch = 2000, .threads = 2 });
}

static void hidden_rectangles_are_told(void **state)
{
    (void)state;
    const trip_camera c = surfel_camera(9);
    trip_budget *budget;
    trip_surfels_cpu *s;
    assert_int_equal(trip_budget_create(&budget, 64u << 20), 0);
    assert_int_equal(
        trip_surfels_cpu_begin(
            &s, &(trip_surfels_cpu_params){ .camera = &c, .settings = &plain, .budget = budget }),
        0);
    surfel_check_hidden(s);
    trip_surfels_cpu_end(s);
    trip_budget_destroy(budget);
}

static void too_little_memory_is_told(void **state)
{
    (void)state;
    const trip_camera c = surfel_camera(9);
    trip_budget *budget;
    trip_surfels_cpu *s;
    trip_surfels_reference *r;
    assert_int_equal(trip_budget_create(&budget, 1u << 20), 0);
    test_catch_reports();
    assert_true(trip_surfels_cpu_begin(&s, &(trip_surfels_cpu_params){ .camera = &c,
                                                                       .settings = &plain,
                                                                       .budget = budget }) < 0);
    assert_null(s);
    assert_one_report("raise --memory");
    test_catch_reports();
    assert_true(trip_surfels_reference_begin(&r, &c, &plain, budget) < 0);
    assert_one_report("raise --memory");
    assert_null(r);
    assert_true(trip_budget_left_bytes(budget) == trip_budget_limit_bytes(budget));
    trip_budget_destroy(budget);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_disc_has_its_radius_and_an_edge_of_a_pixel),
        cmocka_unit_test(a_plane_is_closed_and_has_its_colour_and_depth),
        cmocka_unit_test(surfels_beyond_the_border_reach_the_picture),
        cmocka_unit_test(far_points_never_get_lost),
        cmocka_unit_test(only_the_front_plane_is_seen),
        cmocka_unit_test(scans_of_one_surface_blend),
        cmocka_unit_test(an_edge_shows_the_surface_behind_it),
        cmocka_unit_test(a_disc_that_lost_its_cell_leaves_no_hole),
        cmocka_unit_test(cpu_draws_the_reference),
        cmocka_unit_test(threads_change_no_bit),
        cmocka_unit_test(order_and_batches_change_no_bit),
        cmocka_unit_test(selection_keeps_all_surfels_that_can_be_told_apart),
        cmocka_unit_test(hidden_surfels_of_noisy_scans_change_no_bit),
        cmocka_unit_test(memory_changes_no_bit),
        cmocka_unit_test(hidden_rectangles_are_told),
        cmocka_unit_test(too_little_memory_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
