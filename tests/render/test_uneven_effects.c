/* Effects in grids with uneven spacing (coordinates.h). Compares them with closed forms, and with
 * an even grid of the same field. The even grid has voxels at all positions that the uneven grid
 * can use. */
#include "effects.h"
#include "emission.h"
#include "scenes.h"
#include "test.h"

/* Steps are 1, 2 and 3 fine voxels. Each axis has half as many voxels as the fine grid. */
enum { EDGE = 20, FINE = 2 * EDGE - 1, SIZE = 9 };
#define FOG 0.05

typedef struct uneven {
    int at[3][EDGE]; /* in fine voxels */
    double tables[3][EDGE];
    trip_coordinates coordinates;
    bool hot; /* the first voxel, which is empty, is the hottest */
} uneven;

static void make_uneven(uneven *u)
{
    static const int steps[EDGE - 1] = { 1, 1, 2, 3, 3, 2, 2, 3, 1, 1, 1, 3, 3, 2, 1, 3, 1, 3, 2 };
    const double *along[3];
    u->hot = false;
    for (int a = 0; a < 3; a++) {
        u->at[a][0] = 0;
        for (int i = 1; i < EDGE; i++)
            u->at[a][i] = u->at[a][i - 1] + steps[(i - 1 + 5 * a) % (EDGE - 1)];
        assert_int_equal(u->at[a][EDGE - 1], FINE - 1);
        for (int i = 0; i < EDGE; i++)
            u->tables[a][i] = 0.5 * u->at[a][i];
        along[a] = u->tables[a];
    }
    u->coordinates = trip_coordinates_make(along, (const int64_t[]){ EDGE, EDGE, EDGE });
}

static trip_affine fine_map(const trip_affine *map)
{
    trip_affine fine = *map;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            fine.m[i][k] *= 0.5;
    return fine;
}

static scene_picture integrate(const scene *s, const trip_camera_params *view,
                               const trip_settings *settings)
{
    return scene_integrate(s, view, settings, &(scene_making){ 0 });
}

static int renderers(void)
{
    int count = 0;
    while (scene_renderers()[count].name)
        count++;
    return count;
}

/* Draws with one of the renderers; the number after the last one selects the integral. */
static scene_picture draw(int number, const scene *s, const trip_camera_params *view,
                          const trip_settings *settings)
{
    return number < renderers() ? scene_draw(s, &scene_renderers()[number], view, settings)
                                : integrate(s, view, settings);
}

static trip_camera_params along_z(const scene *s)
{
    trip_camera_params view = scene_view(s, trip_v3(0, 0, 1), 60, 30, SIZE);
    view.ortho_height = 18;
    return view;
}

static double position_x(const scene *s, const trip_camera_params *view, int x)
{
    trip_vec3 o, d;
    scene_ray(s, view, x, SIZE / 2, &o, &d);
    return o.x;
}

/* The light of a slab is attenuated by the thickness of slab in its way, whatever the number of
 * voxels. */
static void fog_lit_from_the_side_darkens_with_its_thickness(void **state)
{
    (void)state;
    uneven u;
    scene s;
    make_uneven(&u);
    scene_create(&s,
                 &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .coordinates = &u.coordinates });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 1, 1, 1, (float)FOG };
    const trip_camera_params view = along_z(&s);
    const double depth = EDGE - 1, g = 0.4, phase = (1 - g * g) / pow(1 + g * g, 1.5);
    trip_settings settings = scene_with_shadows(trip_v3(1, 0, 0));
    settings.effects.anisotropy = g;
    for (int i = 0; i <= renderers(); i++) {
        scene_picture p = draw(i, &s, &view, &settings);
        for (int x = 0; x < SIZE; x++) {
            double expected = (1 - exp(-FOG * depth)) *
                              (0.3 + 0.7 * phase * exp(-FOG * (depth - position_x(&s, &view, x))));
            assert_close(scene_pixel(&p, x, SIZE / 2)[0], expected, i < renderers() ? 5e-4 : 2e-5);
        }
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

/* Two boxes across x with a gap between them: voxels 3 to 6, and 12 to 15. */
static bool two_boxes(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)j, (void)k, (void)gradient;
    *code = (i >= 3 && i <= 6) || (i >= 12 && i <= 15) ? 65535 : 0;
    return true;
}

/* Returns the extinction at x relative to its maximum, and its integral from x on. Extinction is
 * linear between voxels. */
static double boxes_at(const uneven *u, double x, double *beyond)
{
    const double *t = u->tables[0];
    double here = 0;
    *beyond = 0;
    for (int i = 0; i < EDGE - 1; i++) {
        unsigned a, b;
        two_boxes(NULL, i, 0, 0, &a, NULL);
        two_boxes(NULL, i + 1, 0, 0, &b, NULL);
        const double from = fmin(t[i + 1], fmax(t[i], x)), length = t[i + 1] - t[i];
        const double at = (a + (b - (double)a) * (from - t[i]) / length) / 65535;
        *beyond += (t[i + 1] - from) * (at + b / 65535.0) / 2;
        here = x >= t[i] && x <= t[i + 1] ? at : here;
    }
    return here;
}

/* The lattice blurs edges by its cells. A cell is as long as the mean spacing and has an optical
 * depth of 0.4. */
static void a_box_casts_its_shadow_on_the_next(void **state)
{
    (void)state;
    uneven u;
    scene s;
    make_uneven(&u);
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                      .coordinates = &u.coordinates,
                                      .voxel = two_boxes });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 1, 1, 1, (float)(0.4 * code / 65535) };
    const trip_camera_params view = along_z(&s);
    const trip_settings settings = scene_with_shadows(trip_v3(1, 0, 0));
    for (int i = 0; i <= renderers(); i++) {
        scene_picture p = draw(i, &s, &view, &settings);
        int seen = 0;
        for (int x = 0; x < SIZE; x++) {
            double beyond, here = boxes_at(&u, position_x(&s, &view, x), &beyond);
            double expected =
                (1 - exp(-0.4 * here * (EDGE - 1))) * (0.3 + 0.7 * exp(-0.4 * beyond));
            assert_close(scene_pixel(&p, x, SIZE / 2)[0], expected, i < renderers() ? 0.05 : 1e-4);
            seen += here > 0;
        }
        assert_true(seen >= 3);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

/* Returns the value of voxel (i, j, k) of the uneven grid: a blob with a hard core, off the
 * centre. */
static double value_of(const uneven *u, int i, int j, int k)
{
    const double x = u->tables[0][i] - 8, y = u->tables[1][j] - 10.5, z = u->tables[2][k] - 9;
    if (u->hot)
        return i + j + k == 0 ? 1 : 0.7 * exp(-(x * x + y * y + 0.7 * z * z) / 24);
    return fmin(1, 1.6 * exp(-(x * x + y * y + 0.7 * z * z) / 24));
}

static bool uneven_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const uneven *u = user;
    const double at[3] = { u->tables[0][i] - 8, u->tables[1][j] - 10.5, u->tables[2][k] - 9 };
    *code = (unsigned)lround(65535 * value_of(u, i, j, k));
    for (int a = 0; a < 3; a++)
        gradient[a] = -0.1 * at[a] * value_of(u, i, j, k);
    return true;
}

/* Returns a voxel of the fine grid, linearly interpolated between uneven voxels. */
static bool fine_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const uneven *u = user;
    const int at[3] = { i, j, k };
    int cell[3];
    double part[3], sum = 0;
    (void)gradient;
    for (int a = 0; a < 3; a++) {
        for (cell[a] = 0; cell[a] < EDGE - 2 && u->at[a][cell[a] + 1] <= at[a];)
            cell[a]++;
        part[a] = (double)(at[a] - u->at[a][cell[a]]) / (u->at[a][cell[a] + 1] - u->at[a][cell[a]]);
    }
    for (int n = 0; n < 8; n++)
        sum += value_of(u, cell[0] + (n & 1), cell[1] + (n >> 1 & 1), cell[2] + (n >> 2)) *
               (n & 1 ? part[0] : 1 - part[0]) * (n & 2 ? part[1] : 1 - part[1]) *
               (n & 4 ? part[2] : 1 - part[2]);
    *code = (unsigned)lround(65535 * sum);
    return true;
}

static void create_blob(scene *s, uneven *u, bool fine, bool normals, const trip_affine *map)
{
    scene_create(
        s, &(scene_params){ .dims = { fine ? FINE : EDGE, fine ? FINE : EDGE, fine ? FINE : EDGE },
                            .index_to_world = fine ? fine_map(map) : *map,
                            .coordinates = fine ? NULL : &u->coordinates,
                            .normals = normals,
                            .voxel = fine ? fine_voxel : uneven_voxel,
                            .user = u });
    for (int code = 0; code < 65536; code++)
        s->table[code] = (trip_tf_entry){ 0.3F, 0.2F, 0.4F, 0.5F * (float)code / 65535 };
}

/* Colours the scene for frames without emission. */
static void brighten(scene *s)
{
    for (int code = 0; code < 65536; code++) {
        s->table[code].r *= 3;
        s->table[code].g *= 3;
    }
}

static double off(const scene_picture *a, const scene_picture *b)
{
    double sum = 0;
    const int count = 4 * a->width * a->height;
    for (int i = 0; i < count; i++)
        sum += fabs((double)a->rgba[i] - (double)b->rgba[i]);
    return sum / count;
}

/* Cells of the lattice are at least as long as the mean spacing, or two voxels of the fine grid. A
 * renderer that assumed even spacing would exceed these bounds. */
static void an_even_grid_with_the_same_field_has_the_same_light(void **state)
{
    (void)state;
    const trip_affine identity = trip_affine_identity();
    for (int n = 0; n < 6; n += n ? 2 : 1) { /* 0, 1, 3, 5 */
        const trip_affine *map = n % 2 ? &scene_sheared : &identity;
        uneven u;
        scene few, all;
        make_uneven(&u);
        create_blob(&few, &u, false, false, map);
        create_blob(&all, &u, true, false, map);
        brighten(&few);
        brighten(&all);
        const trip_camera_params view = scene_view(&few, trip_v3(0.4, -1, 0.5), 60, 25, 7);
        trip_settings settings = scene_with_shadows(trip_v3(0.8, -0.3, 0.6));
        settings.effects.shadows = n < 4;
        settings.effects.occlusion = n >= 4;
        settings.effects.anisotropy = 0.3;
        settings.effects.cueing = n < 2 ? 0 : 0.6;
        settings.tolerance = n < 4 ? 1e-5 : 1e-3;
        settings.point_light = n >= 2;
        settings.light_position = trip_affine_point(map, trip_v3(18, 3, 15));
        scene_picture truth = integrate(&all, &view, &settings);
        scene_picture same = integrate(&few, &view, &settings);
        assert_true(scene_difference(&truth, &same) < (n < 4 ? 1e-4 : 3e-3));
        for (int i = 0; i < renderers(); i++) {
            scene_picture p = scene_draw(&few, &scene_renderers()[i], &view, &settings);
            if (!(off(&p, &truth) < 1e-3 && scene_difference(&p, &truth) < 1e-2))
                fail_msg("%d, renderer %d: %g, %g at most", n, i, off(&p, &truth),
                         scene_difference(&p, &truth));
            settings.effects.shadows = settings.effects.occlusion = false;
            scene_picture bare = scene_draw(&few, &scene_renderers()[i], &view, &settings);
            settings.effects.shadows = n < 4;
            settings.effects.occlusion = n >= 4;
            assert_true(scene_difference(&p, &bare) > 0.05);
            scene_picture_free(&bare);
            scene_picture_free(&p);
        }
        scene_picture_free(&same);
        scene_picture_free(&truth);
        scene_destroy(&all);
        scene_destroy(&few);
    }
}

/* Heat has a grid of its own, which may be uneven, too. */
static void begin_heat(scene *s, const scene *hot)
{
    assert_int_equal(trip_emission_create(&s->emission, hot->path, s->budget), 0);
    assert_int_equal(
        trip_emission_begin(s->emission,
                            &(trip_emission_params){ .index_to_world = &s->data->index_to_world,
                                                     .kelvin = { 500, 6500 },
                                                     .threads = 1 }),
        0);
}

static void heat_of_uneven_spacing_lies_at_its_voxels(void **state)
{
    (void)state;
    const trip_affine identity = trip_affine_identity();
    uneven u;
    scene few, hot[2];
    make_uneven(&u);
    create_blob(&few, &u, false, false, &identity);
    u.hot = true;
    create_blob(&hot[0], &u, true, false, &identity);
    create_blob(&hot[1], &u, false, false, &identity);
    const trip_camera_params view = scene_view(&few, trip_v3(0.4, -1, 0.5), 60, 25, SIZE);
    trip_settings settings = scene_with_shadows(trip_v3(0, 0, 1));
    settings.effects.shadows = false;
    scene_picture cold = integrate(&few, &view, &settings), truth = { 0 };
    settings.effects.emission = true;
    for (int n = 0; n < 2; n++) {
        begin_heat(&few, &hot[n]);
        if (n == 0)
            truth = integrate(&few, &view, &settings);
        for (int i = 0; i < renderers(); i++) {
            scene_picture p = scene_draw(&few, &scene_renderers()[i], &view, &settings);
            if (!(scene_difference(&p, &truth) < (n ? 0.03 : 0.02)))
                fail_msg("grid %d, renderer %d: %g", n, i, scene_difference(&p, &truth));
            assert_true(scene_difference(&p, &cold) > 0.1);
            scene_picture_free(&p);
        }
        trip_emission_destroy(few.emission);
        few.emission = NULL;
    }
    scene_picture_free(&truth);
    scene_picture_free(&cold);
    for (int n = 0; n < 2; n++)
        scene_destroy(&hot[n]);
    scene_destroy(&few);
}

static trip_settings some_effects(int n)
{
    trip_settings settings = scene_with_shadows(trip_v3(0.8, -0.3, 0.6));
    settings.classify = n & 1 ? TRIP_CLASSIFY_POST : TRIP_CLASSIFY_PRE;
    settings.footprint = n & 1 ? TRIP_FOOTPRINT_EXACT : TRIP_FOOTPRINT_EWA;
    settings.shading = n & 2;
    settings.effects.occlusion = n & 4;
    settings.effects.cueing = n & 4 ? 0.5 : 0;
    settings.effects.emission = n & 8;
    settings.effects.anisotropy = -0.3;
    return settings;
}

static void every_renderer_draws_the_effects_alike(void **state)
{
    (void)state;
    uneven u;
    scene s, hot;
    make_uneven(&u);
    create_blob(&s, &u, false, true, &scene_sheared);
    u.hot = true;
    create_blob(&hot, &u, false, false, &scene_sheared);
    begin_heat(&s, &hot);
    trip_camera_params view = scene_view(&s, trip_v3(0.4, -1, 0.5), 60, 50, 24);
    for (int n = 0; n < 32; n++) {
        trip_settings settings = some_effects(n);
        settings.point_light = n & 16;
        settings.light_position = trip_affine_point(&scene_sheared, trip_v3(18, 3, 15));
        view.ortho_height = n & 2 ? 50 : 0;
        scene_picture reference = scene_draw(&s, &scene_renderers()[0], &view, &settings);
        for (int i = 1; i < renderers(); i++) {
            scene_picture p = draw(i, &s, &view, &settings);
            double apart = scene_difference(&reference, &p);
            if (!(apart < 2e-3))
                fail_msg("%d, %s: %g apart", n, scene_renderers()[i].name, apart);
            scene_picture_free(&p);
        }
        scene_picture_free(&reference);
    }
    trip_emission_destroy(s.emission);
    scene_destroy(&hot);
    scene_destroy(&s);
}

/* Clipping uses positions of voxels. It removes the first box, which has voxels close together. By
 * their indices, some of the box's voxels would be on the other side. */
static void clipped_voxels_cast_no_shadow(void **state)
{
    (void)state;
    const double cut = 4;
    uneven u;
    scene s;
    make_uneven(&u);
    for (int i = 0; i < EDGE; i++)
        u.tables[0][i] = i < 10 ? i / 3.0 : 3 + (i - 9) * 1.6;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                      .coordinates = &u.coordinates,
                                      .voxel = two_boxes });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 1, 1, 1, (float)(0.4 * code / 65535) };
    const trip_camera_params view = along_z(&s);
    trip_settings settings = scene_with_shadows(trip_v3(-1, 0, 0));
    trip_clip_add(&settings.clip, trip_v3(1, 0, 0), -cut);
    for (int i = 0; i <= renderers(); i++) {
        scene_picture p = draw(i, &s, &view, &settings);
        int seen = 0;
        for (int x = 0; x < SIZE; x++) {
            double at = position_x(&s, &view, x), beyond, all, here = boxes_at(&u, at, &beyond);
            boxes_at(&u, cut, &all);
            if (at < cut)
                here = 0;
            double expected =
                (1 - exp(-0.4 * here * (EDGE - 1))) * (0.3 + 0.7 * exp(-0.4 * (all - beyond)));
            assert_close(scene_pixel(&p, x, SIZE / 2)[0], expected, i < renderers() ? 0.05 : 1e-4);
            seen += here > 0;
        }
        assert_true(seen >= 3);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

static void even_coordinates_change_nothing(void **state)
{
    (void)state;
    uneven u, none;
    scene with, without, hot[2];
    make_uneven(&u);
    for (int a = 0; a < 3; a++)
        for (int i = 0; i < EDGE; i++)
            u.tables[a][i] = i;
    none = u;
    none.coordinates = (trip_coordinates){ .along = { NULL }, .widest = 1 };
    create_blob(&with, &u, false, true, &scene_sheared);
    create_blob(&without, &none, false, true, &scene_sheared);
    u.hot = none.hot = true;
    create_blob(&hot[0], &u, false, false, &scene_sheared);
    create_blob(&hot[1], &none, false, false, &scene_sheared);
    begin_heat(&with, &hot[0]);
    begin_heat(&without, &hot[1]);
    const trip_camera_params view = scene_view(&with, trip_v3(0.4, -1, 0.5), 60, 50, 12);
    for (int n = 0; n < 16; n++) {
        const trip_settings settings = some_effects(n);
        for (int i = 0; i < renderers(); i++) {
            scene_picture p = scene_draw(&with, &scene_renderers()[i], &view, &settings);
            scene_picture q = scene_draw(&without, &scene_renderers()[i], &view, &settings);
            assert_true(scene_difference(&p, &q) <= (i ? 1e-3 : 1e-6));
            scene_picture_free(&p);
            scene_picture_free(&q);
        }
    }
    trip_emission_destroy(with.emission);
    trip_emission_destroy(without.emission);
    for (int n = 0; n < 2; n++)
        scene_destroy(&hot[n]);
    scene_destroy(&with);
    scene_destroy(&without);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fog_lit_from_the_side_darkens_with_its_thickness),
        cmocka_unit_test(a_box_casts_its_shadow_on_the_next),
        cmocka_unit_test(an_even_grid_with_the_same_field_has_the_same_light),
        cmocka_unit_test(heat_of_uneven_spacing_lies_at_its_voxels),
        cmocka_unit_test(every_renderer_draws_the_effects_alike),
        cmocka_unit_test(clipped_voxels_cast_no_shadow),
        cmocka_unit_test(even_coordinates_change_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
