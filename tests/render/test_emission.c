/* Emission by a second data set. Compares slabs with closed forms and Simpson's rule, and the
 * renderers with each other. */
#include "emission.h"

#include "black_body.h"
#include "scenes.h"
#include "test.h"

enum { EDGE = 20, SIZE = 9, HOTTEST = 65535 };
#define FOG 0.05

static const double kelvin[2] = { 300, 2400 };

/* Computes E of emission.h. */
static void radiance(double heat, double rgb[3])
{
    const double t = kelvin[0] + (kelvin[1] - kelvin[0]) * heat;
    trip_black_body(t, rgb);
    for (int i = 0; i < 3; i++)
        rgb[i] = trip_display_of_linear(rgb[i] * pow(t / kelvin[1], 4));
}

/* Creates constant fog in a cube. */
static void create_fog(scene *s, float grey)
{
    scene_create(s, &(scene_params){ .dims = { EDGE, EDGE, EDGE } });
    for (int code = 0; code < 65536; code++)
        s->table[code] = (trip_tf_entry){ grey, grey, grey, (float)FOG };
}

/* Adds a heat volume on a grid of its own to the scene `s`. */
static void heat(scene *s, scene *hot, const scene_params *params, int cells)
{
    scene_create(hot, params);
    assert_int_equal(trip_emission_create(&s->emission, hot->path, s->budget), 0);
    assert_int_equal(
        trip_emission_begin(s->emission,
                            &(trip_emission_params){ .index_to_world = &s->data->index_to_world,
                                                     .kelvin = { kelvin[0], kelvin[1] },
                                                     .cells = cells,
                                                     .threads = 1 }),
        0);
}

static void destroy(scene *s, scene *hot)
{
    trip_emission_destroy(s->emission);
    scene_destroy(hot);
    scene_destroy(s);
}

static trip_settings with_emission(void)
{
    trip_settings s = trip_settings_default();
    s.classify = TRIP_CLASSIFY_POST;
    s.samples_per_sheet = 4;
    s.shading = false;
    s.background[3] = 0;
    s.tolerance = 1e-5;
    s.effects.emission = true;
    return s;
}

static trip_camera_params along_z(const scene *s)
{
    trip_camera_params view = scene_view(s, trip_v3(0, 0, 1), 60, 30, SIZE);
    view.ortho_height = 18;
    return view;
}

static scene_picture integrate(const scene *s, const trip_camera_params *view,
                               const trip_settings *settings)
{
    return scene_integrate(s, view, settings, &(scene_making){ 0 });
}

/* Compares the centre of the picture with a colour, for the integral and for all renderers that
 * support `post`. */
static void assert_middle(const scene *s, const trip_settings *settings, const double expected[3],
                          double exact, double bound)
{
    const trip_camera_params view = along_z(s);
    scene_picture p = integrate(s, &view, settings);
    for (int k = 0; k < 3; k++)
        assert_close((double)scene_pixel(&p, 4, 4)[k], expected[k], exact);
    scene_picture_free(&p);
    scene_turn turn = scene_turns(scene_renderers_post(), s, &view, settings);
    while (scene_take_turn(&turn))
        for (int k = 0; k < 3; k++)
            assert_close((double)scene_pixel(&turn.picture, 4, 4)[k], expected[k], bound);
}

static bool even(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)i, (void)j, (void)k, (void)gradient;
    *code = *(unsigned *)user;
    return true;
}

/* The fog is grey, so that scattering keeps the light. */
static void a_slab_of_even_heat_radiates_as_much_as_it_absorbs(void **state)
{
    (void)state;
    const double opacity = 1 - exp(-FOG * (EDGE - 1)), grey = 0.25;
    for (unsigned tenth = 0; tenth <= 10; tenth += 5) {
        unsigned code = HOTTEST * tenth / 10;
        scene s, hot;
        double expected[3];
        create_fog(&s, (float)grey);
        heat(&s, &hot,
             &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = even, .user = &code }, 0);
        radiance(code / (double)HOTTEST, expected);
        for (int k = 0; k < 3; k++)
            expected[k] = opacity * (grey + expected[k]);
        const trip_settings settings = with_emission();
        assert_middle(&s, &settings, expected, 2e-5, 2e-5);
        destroy(&s, &hot);
    }
}

/* Half of the codes lie between 0 and 1500, half between 1500 and 2000. */
static void heat_of_uneven_codes_is_the_value(void **state)
{
    (void)state;
    static const double table[3] = { 0, 1500, 2000 };
    const trip_codes codes = trip_codes_from_table(table, 3, 15);
    const double opacity = 1 - exp(-FOG * (EDGE - 1)), grey = 0.25;
    for (unsigned quarter = 1; quarter < 4; quarter++) {
        unsigned code = 16384 * quarter;
        const double value = quarter < 3 ? 750.0 * quarter : 1750;
        scene s, hot;
        double expected[3];
        create_fog(&s, (float)grey);
        heat(&s, &hot,
             &(scene_params){
                 .dims = { EDGE, EDGE, EDGE }, .codes = &codes, .voxel = even, .user = &code },
             0);
        radiance(value / codes.hi, expected);
        for (int k = 0; k < 3; k++)
            expected[k] = opacity * (grey + expected[k]);
        const trip_settings settings = with_emission();
        assert_middle(&s, &settings, expected, 2e-5, 2e-5);
        destroy(&s, &hot);
    }
}

/* Heat rises along z from 0 to its maximum. */
static bool rising(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)i, (void)j, (void)gradient;
    *code = (unsigned)lround(HOTTEST * k / (double)*(int *)user);
    return true;
}

/* Integrates down the z axis by Simpson's rule. Heat rises linearly from z = 0 over a height and
 * does not end beyond it. */
static void rising_radiance(double height, double out[3])
{
    enum { STEPS = 4000 };
    const double depth = EDGE - 1;
    for (int k = 0; k < 3; k++)
        out[k] = 0;
    for (int n = 0; n <= STEPS; n++) {
        const double t = depth * n / STEPS, weight = n == 0 || n == STEPS ? 1 : n % 2 ? 4 : 2;
        double rgb[3];
        radiance((depth - t) / height, rgb);
        for (int k = 0; k < 3; k++)
            out[k] += weight * FOG * exp(-FOG * t) * rgb[k] * depth / STEPS / 3;
    }
}

/* Voxels of the heat are 1 long, or 2, 3 and 2, and have another origin. Cells of the lattice are
 * one voxel. */
static void heat_lies_at_the_positions_of_its_own_grid(void **state)
{
    (void)state;
    const scene_params grids[] = {
        { .dims = { EDGE, EDGE, EDGE }, .voxel = rising },
        { .dims = { 14, 9, 12 },
          .index_to_world = { { { 2, 0, 0, -3 }, { 0, 3, 0, -2 }, { 0, 0, 2, 0 } } },
          .voxel = rising },
    };
    for (int n = 0; n < 2; n++) {
        scene s, hot;
        double expected[3];
        int last = (int)grids[n].dims[2] - 1;
        scene_params params = grids[n];
        params.user = &last;
        create_fog(&s, 0);
        heat(&s, &hot, &params, 0);
        rising_radiance(n ? 2 * last : last, expected);
        const trip_settings settings = with_emission();
        assert_middle(&s, &settings, expected, 1e-4, 5e-4);
        destroy(&s, &hot);
    }
}

/* Heat fills x up to 7 and falls to 0 over the next voxel. */
static void beyond_its_grid_heat_falls_to_nothing_over_a_voxel(void **state)
{
    (void)state;
    scene s, hot;
    create_fog(&s, 0);
    heat(&s, &hot, &(scene_params){ .dims = { 8, EDGE, EDGE } }, 0);
    const trip_camera_params view = along_z(&s);
    const trip_settings settings = with_emission();
    const double opacity = 1 - exp(-FOG * (EDGE - 1));
    scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
    while (scene_take_turn(&turn))
        for (int x = 0; x < SIZE; x++) {
            trip_vec3 o, d;
            double expected[3];
            scene_ray(&s, &view, x, 4, &o, &d);
            radiance(fmin(1, fmax(0, 8 - o.x)), expected);
            for (int k = 0; k < 3; k++)
                assert_close((double)scene_pixel(&turn.picture, x, 4)[k], opacity * expected[k],
                             5e-5);
        }
    destroy(&s, &hot);
}

static bool ball(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    const double d[3] = { i - 9.3, j - 10.1, k - 9.7 };
    const double r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    *code = (unsigned)lround(HOTTEST * exp(-r2 / 30));
    for (int a = 0; a < 3; a++)
        gradient[a] = -d[a] * exp(-r2 / 30) / 15;
    return true;
}

static double mean_off(const scene_picture *a, const scene_picture *b)
{
    double sum = 0;
    for (int i = 0; i < 4 * SIZE * SIZE; i++)
        sum += fabs((double)a->rgba[i] - (double)b->rgba[i]);
    return sum / (4 * SIZE * SIZE);
}

/* Compares with the integral that uses a lattice of one voxel. */
static void the_error_falls_as_the_lattice_becomes_finer(void **state)
{
    (void)state;
    double before = INFINITY;
    for (int cells = 5; cells <= 10; cells *= 2) {
        scene s, hot;
        create_fog(&s, 0);
        heat(&s, &hot, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = ball }, 0);
        const trip_camera_params view = scene_view(&s, trip_v3(0.4, -1, 0.5), 60, 30, SIZE);
        const trip_settings settings = with_emission();
        scene_picture exact = integrate(&s, &view, &settings);
        destroy(&s, &hot);
        create_fog(&s, 0);
        heat(&s, &hot, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = ball }, cells);
        scene_picture p = scene_draw(&s, &scene_renderers()[0], &view, &settings);
        const double error = mean_off(&p, &exact);
        if (!(error < before / 1.8))
            fail_msg("%d cells: %g, before %g", cells, error, before);
        before = error;
        scene_picture_free(&p);
        scene_picture_free(&exact);
        destroy(&s, &hot);
    }
    assert_true(before < 0.02);
}

/* Draws with all other effects and settings of classification, in a grid with the map
 * scene_sheared. */
static void every_renderer_draws_emission_alike(void **state)
{
    (void)state;
    scene s, hot;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                      .index_to_world = scene_sheared,
                                      .normals = true,
                                      .voxel = ball });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 0.3F, 0.2F, 0.4F, (float)(0.6 * code / 65535) };
    heat(&s, &hot, &(scene_params){ .dims = { 9, 16, 12 }, .voxel = rising, .user = &(int){ 11 } },
         0);
    const trip_camera_params view = scene_view(&s, trip_v3(0.4, -1, 0.5), 60, 50, 24);
    for (int n = 0; n < 8; n++) {
        trip_settings settings = with_emission();
        settings.classify = n & 1 ? TRIP_CLASSIFY_POST : TRIP_CLASSIFY_PRE;
        settings.shading = n & 2;
        settings.headlight = !(n & 4);
        settings.light_direction = trip_v3(0.6, 0, 0.8);
        settings.effects.shadows = n & 4;
        settings.effects.cueing = n & 4 ? 0.4 : 0;
        scene_picture reference = scene_draw(&s, &scene_renderers()[0], &view, &settings);
        scene_turn turn = scene_turns(scene_renderers() + 1, &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            double apart = scene_difference(&turn.picture, &reference);
            if (!(apart < 2e-3))
                fail_msg("%s, %d: %g apart", turn.renderer->name, n, apart);
        }
        settings.effects.emission = false;
        scene_picture cold = scene_draw(&s, &scene_renderers()[1], &view, &settings);
        assert_true(scene_difference(&cold, &reference) > 0.05);
        scene_picture_free(&cold);
        scene_picture_free(&reference);
    }
    destroy(&s, &hot);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_slab_of_even_heat_radiates_as_much_as_it_absorbs),
        cmocka_unit_test(heat_of_uneven_codes_is_the_value),
        cmocka_unit_test(heat_lies_at_the_positions_of_its_own_grid),
        cmocka_unit_test(beyond_its_grid_heat_falls_to_nothing_over_a_voxel),
        cmocka_unit_test(the_error_falls_as_the_lattice_becomes_finer),
        cmocka_unit_test(every_renderer_draws_emission_alike),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
