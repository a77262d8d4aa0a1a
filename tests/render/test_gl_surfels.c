/* Deferred pictures by gl: closed forms, beside cpu and the reference, batches, memory, cancelling.
 * Rounding decides rarely whether a surfel covers a pixel, or lies within a tolerance. */
#include "scenes.h"
#include "surfel_scenes.h"
#include "surfels_cpu.h"
#include "surfels_reference.h"
#include "test.h"

typedef struct desk {
    trip_budget *budget;
    trip_renderer *renderer;
    const trip_surfel_device *device;
} desk;

static desk open_desk(void)
{
    desk d;
    assert_int_equal(trip_budget_create(&d.budget, 64u << 20), 0);
    assert_int_equal(trip_gl_create(&d.renderer, d.budget), 0);
    d.device = d.renderer->ops->surfel_device(d.renderer);
    assert_non_null(d.device);
    return d;
}

static void close_desk(desk *d)
{
    d->renderer->ops->destroy(d->renderer);
    assert_true(trip_budget_left_bytes(d->budget) == trip_budget_limit_bytes(d->budget));
    trip_budget_destroy(d->budget);
}

typedef struct drawn {
    float rgba[4 * SURFEL_PIXELS], depth[SURFEL_PIXELS];
    uint8_t visible[SURFEL_SCENE]; /* by number */
    trip_surfels_cpu_stats stats;
} drawn;

static drawn one, other;
static trip_gaussian surfels[SURFEL_SIDE * SURFEL_SIDE];

/* Draws with the device of a desk, or by cpu if the desk has none. */
static trip_surfels_cpu *begin(const desk *d, const trip_camera *c)
{
    trip_surfels_cpu *s;
    const trip_surfels_cpu_params params = {
        .camera = c, .settings = &surfel_full, .budget = d->budget, .device = d->device
    };
    assert_int_equal(trip_surfels_cpu_begin(&s, &params), 0);
    return s;
}

static void mark(void *context, uint32_t number)
{
    ((drawn *)context)->visible[number] = 1;
}

static void end(trip_surfels_cpu *s, drawn *out)
{
    memset(out, 0, sizeof *out);
    assert_int_equal(trip_surfels_cpu_picture(s, out->rgba, out->depth), 0);
    trip_surfels_cpu_each_visible(s, mark, out);
    out->stats = trip_surfels_cpu_get_stats(s);
    trip_surfels_cpu_end(s);
}

static void draw(const desk *d, drawn *out, const trip_camera *c, const trip_gaussian *all,
                 size_t count)
{
    trip_surfels_cpu *s = begin(d, c);
    assert_int_equal(trip_surfels_cpu_add(s, all, count, 0), 0);
    end(s, out);
}

/* Returns the number of pixels that differ. */
static int pixels_apart(void)
{
    int apart = 0;
    for (int at = 0; at < SURFEL_PIXELS; at++) {
        const double a = (double)one.depth[at], b = (double)other.depth[at];
        apart += test_max_apart(one.rgba + 4 * at, other.rgba + 4 * at, 4) > 1e-3 ||
                 isinf(a) != isinf(b) || (isfinite(a) && fabs(a - b) > 1e-4 * b);
    }
    return apart;
}

/* ---- closed forms ---- */

/* 10 px per unit. The centre of pixel (75, 45) is at (75.5, 45.5). */
static const double units_high = 9;

static void a_disc_has_its_radius_depth_and_an_edge_of_a_pixel(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    desk d = open_desk();
    const trip_camera c = surfel_camera(units_high);
    trip_gaussian g = surfel_at(-0.05, -0.05, 5, 2, 0);
    const double radius = sqrt(2 * log(2) * (1.5 * 1.5 * 17 * 17 + 0.4));
    const double *behind = surfel_full.background;
    surfel_colour(&g, 0.25, 0.5, 1);
    draw(&d, &one, &c, &g, 1);
    for (int i = 0; i < 40; i++) {
        const double a = fmax(0, fmin(1, radius - i)), rest = (1 - a) * behind[3];
        const int places[] = { 75 + i, 75 - i }, row = 45 * SURFEL_WIDTH;
        for (int k = 0; k < 2; k++) {
            const float *p = one.rgba + 4 * (row + places[k]);
            assert_close((double)p[0], 0.25 * a + rest * behind[0], 1e-4);
            assert_close((double)p[1], 0.5 * a + rest * behind[1], 1e-4);
            assert_close((double)p[2], a + rest * behind[2], 1e-4);
            assert_close((double)p[3], a + rest, 1e-4);
        }
        if (a > 0)
            assert_close((double)one.depth[row + 75 + i], 5, 1e-6);
        else
            assert_true(isinf(one.depth[row + 75 + i]));
    }
    assert_int_equal(one.stats.visible, 1);
    close_desk(&d);
}

static void a_tilted_plane_is_closed_and_has_its_depth(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    desk d = open_desk();
    const double angle = 1, distance = 0.3;
    const trip_camera c = surfel_camera(units_high);
    surfel_plane(surfels, 5, distance, angle);
    for (int k = 0; k < SURFEL_SIDE * SURFEL_SIDE; k++)
        surfel_colour(&surfels[k], 0.25, 0.5, 0.75);
    trip_surfels_cpu *s = begin(&d, &c);
    assert_int_equal(trip_surfels_cpu_add(s, surfels, SURFEL_SIDE * SURFEL_SIDE, 0), 0);
    assert_int_equal(trip_surfels_cpu_picture(s, one.rgba, one.depth), 0);
    trip_surfels_cpu_end(s);
    for (int at = 0; at < SURFEL_PIXELS; at++) {
        const double y = 4.5 - (at / SURFEL_WIDTH + 0.5) / 10; /* z = 5 + y tan(angle) */
        if (5 + y * tan(angle) < 0.5)
            continue;
        assert_close((double)one.rgba[4 * at], 0.25, 1e-5);
        assert_close((double)one.rgba[4 * at + 1], 0.5, 1e-5);
        assert_close((double)one.rgba[4 * at + 3], 1, 1e-5);
        assert_close((double)one.depth[at], 5 + y * tan(angle), 0.06 + 0.12 * tan(angle));
    }
    close_desk(&d);
}

/* A cell takes the least number among equal surfels, in any order of the batches. */
static void equal_surfels_are_taken_in_the_order_of_their_numbers(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    desk d = open_desk();
    const trip_camera c = surfel_camera(units_high);
    trip_gaussian g[3];
    for (int i = 0; i < 3; i++) {
        g[i] = surfel_at(-0.05, -0.05, 5, 2, 0);
        surfel_colour(&g[i], i == 0, i == 1, i == 2);
    }
    static const int orders[][3] = { { 0, 1, 2 }, { 2, 1, 0 }, { 1, 0, 2 }, { 1, 2, 0 } };
    for (int i = 0; i < 4; i++) {
        trip_surfels_cpu *s = begin(&d, &c);
        for (int k = 0; k < 3; k++)
            assert_int_equal(trip_surfels_cpu_add(s, &g[orders[i][k]], 1, (uint32_t)orders[i][k]),
                             0);
        end(s, &one);
        const float *p = one.rgba + 4 * (45 * SURFEL_WIDTH + 75);
        assert_close((double)p[0], 1, 1e-6);
        assert_close((double)p[1] + (double)p[2], 0, 1e-6);
        assert_true(one.visible[0] && !one.visible[1] && !one.visible[2]);
    }
    close_desk(&d);
}

/* ---- beside cpu and the reference ---- */

static void gl_draws_what_cpu_and_the_reference_draw(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    desk d = open_desk(), cpu = { .budget = d.budget };
    for (int ortho = 0; ortho < 2; ortho++) {
        const trip_camera c = surfel_camera(ortho ? 20 : 0);
        int apart = 0;
        draw(&d, &one, &c, surfel_scene(), SURFEL_SCENE);
        draw(&cpu, &other, &c, surfel_scene(), SURFEL_SCENE);
        assert_in_range(pixels_apart(), 0, SURFEL_PIXELS / 1000);
        for (int i = 0; i < SURFEL_SCENE; i++)
            apart += one.visible[i] != other.visible[i];
        assert_in_range(apart, 0, 2);
        assert_in_range(one.stats.visible, 300, SURFEL_SCENE);
        trip_surfels_reference *r;
        assert_int_equal(trip_surfels_reference_begin(&r, &c, &surfel_full, d.budget), 0);
        assert_int_equal(trip_surfels_reference_add(r, surfel_scene(), SURFEL_SCENE, 0), 0);
        trip_surfels_reference_picture(r, other.rgba, other.depth);
        trip_surfels_reference_end(r);
        assert_in_range(pixels_apart(), 0, SURFEL_PIXELS / 500);
    }
    close_desk(&d);
}

/* Each case lies at a limit of the footprint. */
static void hard_surfels_agree(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    desk d = open_desk(), cpu = { .budget = d.budget };
    trip_gaussian edge_on = surfel_at(0, 0, 3, 1, 1.5707963), far = surfel_at(1e9, 0, 1e9, 1e9, 0);
    trip_gaussian needle = surfel_at(2000, 1000, 10, 0.02, 0);
    needle.deviations[0] = 2000;
    needle.rotation[0] = (float)cos(atan(0.5) / 2);
    needle.rotation[3] = (float)sin(atan(0.5) / 2);
    const trip_gaussian cases[] = {
        edge_on,
        far,
        needle,
        surfel_at(0, 0, 0.3, 50, 0.1),      /* around the eye in perspective */
        surfel_at(0, 0, 0, 0, 0),           /* at the eye */
        surfel_at(0, 0, -5, 1, 0),          /* behind it */
        surfel_at(0.1, 0.1, 5, 1e-30, 0.3), /* a point */
        surfel_at(-6, -3, 5, 2, 0.7),       /* beyond the corner */
        surfel_at(0, -1, 3, 5, 1.5),        /* the ground */
    };
    int seen = 0;
    for (int ortho = 0; ortho < 2; ortho++)
        for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
            const trip_camera c = surfel_camera(ortho ? units_high : 0);
            draw(&d, &one, &c, &cases[i], 1);
            draw(&cpu, &other, &c, &cases[i], 1);
            assert_in_range(pixels_apart(), 0, 3);
            assert_int_equal(one.stats.visible, other.stats.visible);
            seen += (int)one.stats.visible;
        }
    assert_in_range(seen, 9, 18);
    close_desk(&d);
}

/* ---- batches, memory and cancelling ---- */

static void batches_and_memory_change_no_bit(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    desk d = open_desk();
    const trip_camera c = surfel_camera(0);
    draw(&d, &one, &c, surfel_scene(), SURFEL_SCENE);
    assert_int_equal(one.stats.hidden, 0); /* all in one batch */
    for (int little = 0; little < 2; little++) {
        const uint64_t taken = trip_budget_left_bytes(d.budget) - (little ? 7500 * 1024 : 30 << 20);
        assert_true(trip_budget_charge(d.budget, taken));
        trip_surfels_cpu *s = begin(&d, &c);
        for (uint32_t left = SURFEL_SCENE; left > 0; left -= 600)
            assert_int_equal(trip_surfels_cpu_add(s, surfel_scene() + left - 600, 600, left - 600),
                             0);
        end(s, &other);
        trip_budget_discharge(d.budget, taken);
        assert_memory_equal(one.rgba, other.rgba, sizeof one.rgba);
        assert_memory_equal(one.depth, other.depth, sizeof one.depth);
        assert_memory_equal(one.visible, other.visible, sizeof one.visible);
        assert_in_range(other.stats.hidden, 1, SURFEL_SCENE);
    }
    close_desk(&d);
}

static void hidden_rectangles_are_told(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    desk d = open_desk();
    const trip_camera c = surfel_camera(units_high);
    trip_surfels_cpu *s = begin(&d, &c);
    surfel_check_hidden(s);
    trip_surfels_cpu_end(s);
    close_desk(&d);
}

static void expect_refused(const desk *d, const trip_camera *c, const char *line)
{
    trip_surfels_cpu *s;
    const trip_surfels_cpu_params params = {
        .camera = c, .settings = &surfel_full, .budget = d->budget, .device = d->device
    };
    test_catch_reports();
    assert_int_equal(trip_surfels_cpu_begin(&s, &params), TRIP_ERROR);
    assert_one_report(line);
    assert_null(s);
}

static void what_does_not_fit_is_refused_in_a_line(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    desk d = open_desk();
    trip_camera c = surfel_camera(0);
    const uint64_t taken = trip_budget_left_bytes(d.budget) - (4 << 20);
    assert_true(trip_budget_charge(d.budget, taken));
    expect_refused(&d, &c, "150 x 90 px does not fit");
    trip_budget_discharge(d.budget, taken);
    c.width = 40000; /* drivers have 16384 or 32768 */
    c.height = 1;
    expect_refused(&d, &c, "exceed this driver's limit");
    close_desk(&d);
}

static void pictures_do_not_disturb_each_other(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    desk d = open_desk();
    static drawn alone[2];
    const trip_camera c[2] = { surfel_camera(0), surfel_camera(12) };
    trip_surfels_cpu *s[2];
    for (int i = 0; i < 2; i++) {
        draw(&d, &alone[i], &c[i], surfel_scene(), SURFEL_SCENE);
        s[i] = begin(&d, &c[i]);
    }
    for (uint32_t i = 0; i < SURFEL_SCENE; i += 2000)
        for (int k = 0; k < 2; k++) {
            assert_int_equal(trip_surfels_cpu_add(s[k], surfel_scene() + i, 2000, i), 0);
            assert_int_equal(trip_surfels_cpu_picture(s[k], one.rgba, one.depth), 0);
        }
    for (int i = 0; i < 2; i++) {
        end(s[i], &one);
        assert_memory_equal(alone[i].rgba, one.rgba, sizeof one.rgba);
        assert_memory_equal(alone[i].depth, one.depth, sizeof one.depth);
    }
    close_desk(&d);
}

static void a_cancelled_picture_ends_and_the_next_one_is_right(void **state)
{
    (void)state;
    if (!scene_has_gl())
        return;
    desk d = open_desk();
    const trip_camera c = surfel_camera(0);
    draw(&d, &one, &c, surfel_scene(), SURFEL_SCENE);
    trip_scope scope = { 0 };
    trip_scope *before = trip_scope_enter(&scope);
    trip_surfels_cpu *s = begin(&d, &c);
    test_catch_reports();
    assert_int_equal(trip_surfels_cpu_add(s, surfel_scene(), SURFEL_SCENE, 0), 0);
    trip_scope_cancel(&scope);
    assert_int_equal(trip_surfels_cpu_picture(s, other.rgba, other.depth), TRIP_INTERRUPTED);
    trip_surfels_cpu_end(s);
    assert_one_report("interrupted");
    trip_scope_enter(before);
    draw(&d, &other, &c, surfel_scene(), SURFEL_SCENE);
    assert_memory_equal(one.rgba, other.rgba, sizeof one.rgba);
    close_desk(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_disc_has_its_radius_depth_and_an_edge_of_a_pixel),
        cmocka_unit_test(a_tilted_plane_is_closed_and_has_its_depth),
        cmocka_unit_test(equal_surfels_are_taken_in_the_order_of_their_numbers),
        cmocka_unit_test(gl_draws_what_cpu_and_the_reference_draw),
        cmocka_unit_test(hard_surfels_agree),
        cmocka_unit_test(batches_and_memory_change_no_bit),
        cmocka_unit_test(hidden_rectangles_are_told),
        cmocka_unit_test(what_does_not_fit_is_refused_in_a_line),
        cmocka_unit_test(pictures_do_not_disturb_each_other),
        cmocka_unit_test(a_cancelled_picture_ends_and_the_next_one_is_right),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
