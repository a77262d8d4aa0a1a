/* Transfer functions with integrals in closed form, which need no table. Checks which functions
 * have one. Compares the pictures with integrals worked out by hand and with the reference, which
 * uses the table. */
#include "closed_form.h"
#include "cpu/kernels/isa.h"
#include "cpu_scenes.h"
#include "plan.h"
#include "test.h"

#include <string.h>

enum { LAST = 65535 };

#define LONGEST 100.0

static trip_tf_entry table[LAST + 1];

/* Returns an entry of a linear ramp. Extinction rises from `start` by `slope` per code. If `unit`
 * is not 0, the opacity per `unit` length rises instead. */
static trip_tf_entry ramp_at(int code, double start, double slope, double unit)
{
    const double x = slope * (code - start);
    const double k = x <= 0 ? 0 : unit > 0 ? -log1p(-x * unit) / unit : x;
    return (trip_tf_entry){ 0.25F, 0.5F, 1, (float)k };
}

static void make_ramp(double start, double slope, double unit)
{
    for (int code = 0; code <= LAST; code++)
        table[code] = ramp_at(code, start, slope, unit);
}

static double component(const trip_tf_entry *e, int i)
{
    return i == 0 ? (double)e->r : i == 1 ? (double)e->g : (double)e->b;
}

static trip_closed_form_fault find(unsigned min, unsigned max)
{
    trip_closed_form form;
    return trip_closed_form_find(&form, table, min, max, LONGEST);
}

/* Every code of the found form must equal the table. */
static void assert_found(unsigned min, unsigned max, bool ramp, bool coloured)
{
    trip_closed_form f;
    assert_int_equal(trip_closed_form_find(&f, table, min, max, LONGEST), 0);
    assert_int_equal(f.ramp, ramp);
    assert_int_equal(f.coloured, coloured);
    for (unsigned code = min; code <= max; code++) {
        const double x = fmax(0, f.scale * code + f.offset), k = (double)table[code].extinction;
        const double is = f.k[0] + f.k[1] * x + f.k[2] * x * x + f.k[3] * x * x * x;
        assert_true(x <= 1 + 1e-9);
        assert_true(fabs(is - k) <= (k + 1 / LONGEST) / 8192);
        for (int i = 0; i < 3 && k > 0; i++)
            assert_true(fabs(f.q0[i] + f.q1[i] * x - component(&table[code], i)) <= 1.0 / 8192);
    }
}

static void linear_transfer_functions_have_a_closed_form(void **state)
{
    (void)state;
    for (int code = 0; code <= LAST; code++)
        table[code] = (trip_tf_entry){ 0.1F, 0.2F, 0.3F, 0.7F };
    assert_found(0, LAST, false, false);
    assert_found(300, 300, false, false);
    assert_found(300, 302, false, false);
    make_ramp(-1000, 1e-5, 0); /* the ramp begins below the codes */
    assert_found(0, LAST, false, false);
    assert_found(7, 30000, false, false);
    make_ramp(0, 0.1, 0);
    assert_found(0, LAST, true, false);
    make_ramp(13107.3, 1e-4, 0);
    assert_found(0, LAST, true, false);
    assert_found(13000, 40000, true, false);
    assert_found(13108, 40000, false, false);
    for (int code = 0; code <= LAST; code++) { /* the ramp ends, and is coloured */
        table[code] = ramp_at(-code, -40000.5, 2e-5, 0);
        table[code].g = (float)code / LAST;
    }
    assert_found(0, LAST, true, true);
    assert_found(0, 30000, false, true);
}

static void linear_opacity_has_a_closed_form_up_to_a_fifth(void **state)
{
    (void)state;
    make_ramp(0, 0.2 / LAST, 1);
    assert_found(0, LAST, true, false);
    make_ramp(9999.5, 0.2 / (LAST - 9999.5), 1);
    assert_found(5000, LAST, true, false);
    make_ramp(-1000, 0.2 / (LAST + 1000), 1);
    assert_found(0, LAST, false, false);
    make_ramp(0, 0.4 / LAST, 1);
    assert_int_equal(find(0, LAST), TRIP_CLOSED_FORM_EXTINCTION);
    assert_int_equal(find(0, LAST / 2), 0);
}

static void nonlinear_transfer_functions_have_no_closed_form(void **state)
{
    (void)state;
    make_ramp(20000, 1e-4, 0);
    assert_int_equal(find(1, 0), TRIP_CLOSED_FORM_ENDS);
    assert_int_equal(find(0, 20000), TRIP_CLOSED_FORM_ENDS); /* transparent */
    table[20000].extinction = 1;                             /* a step */
    assert_int_equal(find(0, LAST), TRIP_CLOSED_FORM_EXTINCTION);
    assert_int_equal(find(20001, LAST), 0);
    make_ramp(20000, 1e-4, 0);
    table[LAST].extinction = 0; /* a tent */
    assert_int_equal(find(0, LAST), TRIP_CLOSED_FORM_ENDS);
    for (int code = 0; code <= LAST; code++)
        table[code] = ramp_at(code < 30000 ? code : 30000, 20000, 1e-4, 0);
    assert_int_equal(find(0, LAST), TRIP_CLOSED_FORM_EXTINCTION);
    assert_int_equal(find(0, 30000), 0);
    make_ramp(-1, 1e12, 0); /* deeper than single precision can represent */
    assert_int_equal(find(0, LAST), TRIP_CLOSED_FORM_EXTINCTION);
}

/* A single differing code is found, whichever code it is. */
static void one_differing_code_is_found(void **state)
{
    (void)state;
    make_ramp(0, 1e-4, 0);
    for (int i = 0; i < 60; i++) {
        const int code = 20 + (int)(test_random() * (LAST - 40));
        const float k = table[code].extinction, r = table[code].r;
        const double allowed = ((double)k + 1 / LONGEST) / 8192;
        table[code].extinction = (float)((double)k + 2 * allowed);
        assert_int_equal(find(0, LAST), TRIP_CLOSED_FORM_EXTINCTION);
        table[code].extinction = (float)((double)k - 0.5 * allowed);
        assert_int_equal(find(0, LAST), 0);
        table[code].extinction = k;
        table[code].r = r + 2.0F / 8192;
        assert_int_equal(find(0, LAST), TRIP_CLOSED_FORM_COLOUR);
        assert_int_equal(find(0, (unsigned)code - 1), 0); /* only the codes in the range count */
        assert_int_equal(find((unsigned)code + 1, LAST), 0);
        table[code].r = r;
    }
    make_ramp(30000, 1e-4, 0);
    table[100].r = 1; /* at transparent codes */
    assert_int_equal(find(0, LAST), 0);
}

static bool is_closed(const scene *s, const trip_camera_params *view, const trip_settings *settings)
{
    trip_camera camera;
    trip_plan plan;
    assert_int_equal(trip_camera_make(&camera, view, &s->data->index_to_world), 0);
    assert_int_equal(trip_plan_make(&plan, s->data, &camera, settings, s->table, s->budget), 0);
    const bool closed = plan.not_closed == TRIP_CLOSED_FORM_FOUND;
    trip_plan_release(&plan, s->budget);
    return closed;
}

/* Calls `check` for every renderer, and for every instruction set of the CPU renderer. */
static void by_all(void (*check)(const scene_renderer *renderer, void *user), void *user)
{
    for (const scene_renderer *r = scene_renderers_post(); r->name; r++)
        if (strcmp(r->name, "cpu") != 0)
            check(r, user);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        check(&cpu_scenes_cpu, user);
    }
    unsetenv("TRIPTYCH_ISA");
}

/* Two sheets along an axis, each with one code. */
typedef struct sheets {
    int axis;
    unsigned codes[2];
} sheets;

static bool of_sheet(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const sheets *s = user;
    (void)gradient;
    *code = s->codes[(const int[3]){ i, j, k }[s->axis]];
    return true;
}

typedef struct expectation {
    const scene *s;
    const trip_camera_params *view;
    const trip_settings *settings;
    double rgba[4];
} expectation;

static void check_all_pixels(const scene_renderer *renderer, void *user)
{
    const expectation *e = user;
    scene_picture p = scene_draw(e->s, renderer, e->view, e->settings);
    for (int n = 0; n < p.width * p.height; n++)
        for (int c = 0; c < 4; c++)
            assert_close((double)p.rgba[4 * n + c], e->rgba[c], 1e-5);
    scene_picture_free(&p);
}

/* One segment spans both sheets, from code a to code b. Extinction and colour are linear. The mean
 * of a product of linear functions is (2 k0 q0 + k0 q1 + k1 q0 + 2 k1 q1) / 6. Extinction begins
 * at `start`. */
static void one_segment_has_the_integrals_of_linear_functions(void **state)
{
    (void)state;
    static const unsigned codes[][2] = { { 1, LAST },     { 40000, 30000 }, { 50000, 50100 },
                                         { 5000, 25000 }, { 25000, 100 },   { 30000, 30000 },
                                         { 100, 20030 } };
    static const double starts[] = { -3000, 20000.25 };
    const double slope = 6e-5;
    for (int i = 0; i < 7 * 2 * 3; i++) {
        sheets two = { .axis = i % 3, .codes = { codes[i / 6][0], codes[i / 6][1] } };
        const double start = starts[i / 3 % 2];
        scene_params params = { .dims = { 12, 12, 12 }, .voxel = of_sheet, .user = &two };
        params.dims[two.axis] = 2;
        scene s;
        scene_create(&s, &params);
        for (int code = 0; code <= LAST; code++) {
            s.table[code] = ramp_at(code, start, slope, 0);
            s.table[code].r = (float)code / LAST;
            s.table[code].g = 1 - 0.75F * (float)code / LAST;
        }
        double d[3] = { 0, 0, 0 };
        d[two.axis] = i % 2 ? 1 : -1;
        trip_camera_params view = scene_view(&s, trip_v3(d[0], d[1], d[2]), 30, 20, 4);
        view.ortho_height = 3;
        trip_settings settings = scene_post(1);
        assert_true(is_closed(&s, &view, &settings) || two.codes[0] == two.codes[1] ||
                    (two.codes[0] < start && two.codes[1] < start));
        const double a = two.codes[0], b = two.codes[1];
        const double from = fmax(a, start), to = fmax(b, start);
        const double part = a == b ? 1 : (to - from) / (b - a);
        const double k0 = slope * (from - start), k1 = slope * (to - start);
        const double depth = part * 0.5 * (k0 + k1);
        expectation e = { .s = &s, .view = &view, .settings = &settings };
        e.rgba[3] = 1 - exp(-depth);
        for (int c = 0; c < 3 && depth > 0; c++) {
            const double q0 = c == 0 ? from / LAST : c == 1 ? 1 - 0.75 * from / LAST : 1;
            const double q1 = c == 0 ? to / LAST : c == 1 ? 1 - 0.75 * to / LAST : 1;
            const double product = (k0 * (2 * q0 + q1) + k1 * (q0 + 2 * q1)) / 6;
            e.rgba[c] = e.rgba[3] * product / (0.5 * (k0 + k1));
        }
        by_all(check_all_pixels, &e);
        scene_destroy(&s);
    }
}

enum { RISE = 1100 }; /* codes per voxel */

static bool rise(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)gradient;
    *code = RISE * (unsigned)(const int[3]){ i, j, k }[*(int *)user];
    return true;
}

/* A slab of nine sheets with values that rise along an axis. */
typedef struct slab {
    const scene *s;
    const trip_camera_params *view;
    const trip_settings *settings;
    int axis; /* the axis along which values rise */
    double start, slope, unit;
} slab;

/* Returns the integral of -ln(1 - o), the extinction at opacity o = slope (code - start), over o.
 */
static double antiderivative(double o)
{
    return (1 - o) * log1p(-o) + o;
}

/* Returns the mean extinction along a ray with codes that go linearly from a to b. */
static double mean_between(const slab *of, double a, double b)
{
    const double x = of->slope * (a - of->start), y = of->slope * (b - of->start);
    if (of->unit == 0)
        return 0.5 * (x + y);
    if (fabs(y - x) < 1e-6)
        return -log1p(-0.5 * (x + y) * of->unit) / of->unit;
    return (antiderivative(y * of->unit) - antiderivative(x * of->unit)) / (y - x) / of->unit /
           of->unit;
}

static void check_slab(const scene_renderer *renderer, void *user)
{
    const slab *of = user;
    scene_picture p = scene_draw(of->s, renderer, of->view, of->settings);
    for (int n = 0; n < p.width * p.height; n++) {
        trip_vec3 o, d;
        double from, to;
        scene_ray(of->s, of->view, n % p.width, n / p.width, &o, &d);
        assert_true(scene_ray_in_grid(of->s, o, d, &from, &to));
        const double at = trip_component(o, of->axis), by = trip_component(d, of->axis);
        const double mean = mean_between(of, RISE * (at + from * by), RISE * (at + to * by));
        const double alpha = 1 - exp(-mean * (to - from));
        assert_true(alpha > 0.05 && alpha < 0.99);
        assert_close((double)p.rgba[4 * n + 3], alpha, 1.5e-4);
        assert_close((double)p.rgba[4 * n + 1], 0.5 * alpha, 1.5e-4);
    }
    scene_picture_free(&p);
}

static void a_ramp_of_values_is_as_opaque_as_its_integral(void **state)
{
    (void)state;
    for (int i = 0; i < 24; i++) {
        const int axis = i % 3, thin = i / 3 % 2 ? axis : (axis + 1) % 3;
        int along = axis;
        scene_params params = { .dims = { 59, 59, 59 }, .voxel = rise, .user = &along };
        params.dims[thin] = 9;
        scene s;
        scene_create(&s, &params);
        slab of = { .s = &s, .axis = axis, .start = -500, .slope = 4e-6 };
        if (i / 6 % 2) { /* opacity is linear, up to 0.2 */
            of.unit = 0.7;
            of.slope = thin == axis ? 0.2 / 10000 : 0.2 / 65000;
        }
        for (int code = 0; code <= LAST; code++) /* codes that no voxel has do not matter */
            s.table[code] = code > RISE * 58 ? (trip_tf_entry){ 1, 0, 0, 9 }
                                             : ramp_at(code, of.start, of.slope, of.unit);
        if (thin == axis)
            for (int code = RISE * 8 + 1; code <= LAST; code++)
                s.table[code] = (trip_tf_entry){ 1, 0, 0, 9 };
        double d[3] = { 0.2, 0.15, 0.1 };
        d[thin] = i % 2 ? 1 : -1;
        trip_camera_params view = scene_view(&s, trip_v3(d[0], d[1], d[2]), 80, 6, 4);
        view.ortho_height = i / 12 ? 4 : 0;
        trip_settings settings = scene_post(1 + i % 3);
        of.view = &view;
        of.settings = &settings;
        assert_true(is_closed(&s, &view, &settings));
        by_all(check_slab, &of);
        scene_destroy(&s);
    }
}

/* Waves. If `user` points to true, one separate voxel has a code of its own. */
static bool waves(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)gradient;
    *code = (unsigned)(30000 + 14000 * sin(0.5 * i + 0.2) + 14000 * sin(0.4 * j) * cos(0.6 * k));
    if (i == 29 && j == 29 && k == 29) {
        *code = LAST;
        return *(bool *)user;
    }
    return i < 26 && j < 26 && k < 26;
}

/* The pictures to compare with. */
typedef struct comparison {
    const scene *closed;
    const trip_camera_params *view;
    const trip_settings *settings;
    scene_picture expected;
} comparison;

static void check_same(const scene_renderer *renderer, void *user)
{
    const comparison *c = user;
    scene_picture p = scene_draw(c->closed, renderer, c->view, c->settings);
    assert_true(scene_difference(&p, &c->expected) < 0.25 / 255);
    for (int n = 0; n < p.width * p.height && p.depth; n++)
        if (p.rgba[4 * n + 3] > 0.01F)
            assert_close((double)p.depth[n], (double)c->expected.depth[n], 1e-3);
    scene_picture_free(&p);
}

/* Compares the picture with the reference. It also compares the picture with one drawn through the
 * table. For that, an extra voxel, which is not drawn, has a code beyond the linear part of the
 * transfer function. */
static void closed_form_and_table_draw_the_same_picture(void **state)
{
    (void)state;
    for (int i = 0; i < 8; i++) {
        bool apart = false, with = true;
        scene_params params = { .dims = { 30, 30, 30 }, .voxel = waves, .user = &apart };
        scene a, b;
        scene_create(&a, &params);
        params.user = &with;
        scene_create(&b, &params);
        for (int code = 0; code <= LAST; code++) {
            a.table[code] = ramp_at(code, i % 2 ? 21000.5 : -1, 4e-6, 0.5);
            a.table[code].r = (float)code / LAST;
            if (code > 60000)
                a.table[code].extinction = 1;
        }
        memcpy(b.table, a.table, (LAST + 1) * sizeof *a.table);
        trip_camera_params view = scene_view(&a, trip_v3(0.7, 0.5, 1), i < 6 ? 70 : 5, 30, 24);
        view.ortho_height = i == 2 || i == 3 ? 34 : 0;
        trip_settings settings = scene_post(1 + i % 3);
        settings.shading = i != 0;
        settings.kernel = i == 6 ? TRIP_KERNEL_GAUSSIAN : TRIP_KERNEL_LINEAR;
        settings.depth = i == 1 || i == 4;
        if (i == 3 || i == 4 || i == 5) {
            settings.clip.count = 1;
            settings.clip.planes[0] = (trip_half_space){ .normal = { 0.3, 1, 0.2 }, .offset = -17 };
        }
        assert_true(is_closed(&a, &view, &settings));
        assert_false(is_closed(&b, &view, &settings));
        comparison c = { .closed = &a, .view = &view, .settings = &settings };
        c.expected = scene_draw(&a, &cpu_scenes_reference, &view, &settings);
        by_all(check_same, &c);
        c.closed = &b;
        by_all(check_same, &c);
        scene_picture_free(&c.expected);
        scene_destroy(&a);
        scene_destroy(&b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(linear_transfer_functions_have_a_closed_form),
        cmocka_unit_test(linear_opacity_has_a_closed_form_up_to_a_fifth),
        cmocka_unit_test(nonlinear_transfer_functions_have_no_closed_form),
        cmocka_unit_test(one_differing_code_is_found),
        cmocka_unit_test(one_segment_has_the_integrals_of_linear_functions),
        cmocka_unit_test(a_ramp_of_values_is_as_opaque_as_its_integral),
        cmocka_unit_test(closed_form_and_table_draw_the_same_picture),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
