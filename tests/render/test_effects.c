/* Shadows, scattering, ambient occlusion and depth cueing. Compares the integral with closed
 * forms, and the renderers with the integral and with each other. */
#include "dataset_join.h"
#include "effects.h"
#include "light_map.h"
#include "scenes.h"
#include "test.h"

#include <string.h>

enum { EDGE = 20, SIZE = 9 };
#define FOG 0.05

/* Creates constant, white fog. */
static void create_fog(scene *s, float extinction)
{
    scene_create(s, &(scene_params){ .dims = { EDGE, EDGE, EDGE } });
    for (int code = 0; code < 65536; code++)
        s->table[code] = (trip_tf_entry){ 1, 1, 1, extinction };
}

static trip_camera_params along_z(const scene *s)
{
    trip_camera_params view = scene_view(s, trip_v3(0, 0, 1), 60, 30, SIZE);
    view.ortho_height = 18;
    return view;
}

/* Returns the x coordinate of a pixel's ray. */
static double position_x(const scene *s, const trip_camera_params *view, int x, int y)
{
    trip_vec3 o, d;
    scene_ray(s, view, x, y, &o, &d);
    return o.x;
}

static scene_picture integrate(const scene *s, const trip_camera_params *view,
                               const trip_settings *settings)
{
    return scene_integrate(s, view, settings, &(scene_making){ 0 });
}

/* The fog beside a point attenuates the light that reaches it, because the slab is lit from the
 * side. */
static double lit_from_the_side(double x, double g)
{
    const double depth = EDGE - 1, phase = (1 - g * g) / pow(1 + g * g, 1.5);
    return (1 - exp(-FOG * depth)) * (0.3 + 0.7 * phase * exp(-FOG * (depth - x)));
}

static void fog_lit_from_the_side_is_darker_away_from_the_light(void **state)
{
    (void)state;
    scene s;
    create_fog(&s, (float)FOG);
    const trip_camera_params view = along_z(&s);
    for (int n = 0; n < 2; n++) {
        trip_settings settings = scene_with_shadows(trip_v3(1, 0, 0));
        settings.effects.anisotropy = 0.4 * n;
        scene_picture exact = integrate(&s, &view, &settings);
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        for (int x = 0; x < SIZE; x++) {
            double expected =
                lit_from_the_side(position_x(&s, &view, x, 4), settings.effects.anisotropy);
            assert_close(scene_pixel(&exact, x, 4)[0], expected, 2e-5);
        }
        while (scene_take_turn(&turn))
            assert_true(scene_difference(&turn.picture, &exact) < 5e-4);
        scene_picture_free(&exact);
    }
    scene_destroy(&s);
}

/* Light passes through clipped voxels. The cut lies midway between two voxels, and the lattice
 * counts half of the fog between them. */
static void clipped_voxels_cast_no_shadow(void **state)
{
    (void)state;
    const double at = 8.5;
    scene s;
    create_fog(&s, (float)FOG);
    const trip_camera_params view = along_z(&s);
    trip_settings settings = scene_with_shadows(trip_v3(1, 0, 0));
    trip_clip_add(&settings.clip, trip_v3(-1, 0, 0), at);
    scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
    scene_picture exact = integrate(&s, &view, &settings);
    int left = 0;
    for (int x = 0; x < SIZE; x++) {
        const double position = position_x(&s, &view, x, 4);
        const double expected = position > at ? 0
                                              : (1 - exp(-FOG * (EDGE - 1))) *
                                                    (0.3 + 0.7 * exp(-FOG * (at - position)));
        assert_close(scene_pixel(&exact, x, 4)[0], expected, 2e-5);
        left += position < at;
    }
    assert_in_range(left, 2, SIZE - 2);
    while (scene_take_turn(&turn))
        assert_true(scene_difference(&turn.picture, &exact) < 1e-3);
    scene_picture_free(&exact);
    scene_destroy(&s);
}

/* A fifth of a segment between two sample planes remains. The midpoint determines the segment's
 * cueing and distance. */
static void the_rest_of_a_clipped_segment_fades_at_its_own_depth(void **state)
{
    (void)state;
    const double from = 7.1, to = 7.3, middle = 7.2, depth = 50 * (to - from);
    scene s;
    create_fog(&s, 50);
    const trip_camera_params view = along_z(&s);
    trip_settings settings = scene_post(1);
    settings.early_termination = 0;
    settings.effects.cueing = 1;
    settings.depth = true;
    trip_clip_add(&settings.clip, trip_v3(0, 0, 1), -from);
    trip_clip_add(&settings.clip, trip_v3(0, 0, -1), to);
    scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
    while (scene_take_turn(&turn)) {
        const double tolerance = 1e-4 + 0.1 * turn.renderer->tolerance;
        const float *c = scene_pixel(&turn.picture, 4, 4);
        assert_close(c[3], 1 - exp(-depth), tolerance);
        assert_close(c[0], (1 - exp(-depth)) * middle / (EDGE - 1), tolerance);
        assert_close(turn.picture.depth[4 * SIZE + 4], view.eye.z - middle, tolerance);
    }
    scene_destroy(&s);
}

/* The light shines from the eye's side. Light and view cross the same fog, and scattering turns
 * the light back by 180 degrees. */
static void fog_lit_from_the_front_scatters_backwards(void **state)
{
    (void)state;
    scene s;
    create_fog(&s, (float)FOG);
    const trip_camera_params view = along_z(&s);
    trip_settings settings = scene_with_shadows(trip_v3(0, 0, 1));
    settings.effects.anisotropy = 0.3;
    const double g = 0.3, depth = FOG * (EDGE - 1), phase = (1 - g * g) / pow(1 + g, 3);
    scene_picture exact = integrate(&s, &view, &settings);
    double expected = 0.3 * (1 - exp(-depth)) + 0.7 * phase * (1 - exp(-2 * depth)) / 2;
    assert_close(scene_pixel(&exact, 4, 4)[0], expected, 2e-5);
    scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
    while (scene_take_turn(&turn))
        assert_close(scene_pixel(&turn.picture, 4, 4)[0], expected, 1e-3);
    scene_picture_free(&exact);
    scene_destroy(&s);
}

static trip_settings with_point_light(trip_vec3 position)
{
    trip_settings s = scene_with_shadows(trip_v3(0, 0, 1));
    s.point_light = true;
    s.light_position = position;
    return s;
}

/* Returns the length of the path from a point inside the box of voxel centres to another point
 * that is inside it too. */
static double length_in_box(trip_vec3 from, trip_vec3 to)
{
    const trip_vec3 way = trip_sub(to, from);
    double end = 1;
    for (int a = 0; a < 3; a++) {
        double d = trip_component(way, a), limit = d > 0 ? EDGE - 1 : 0;
        end = d == 0 ? end : fmin(end, (limit - trip_component(from, a)) / d);
    }
    return end * trip_length(way);
}

/* Integrates along a pixel's ray down the z axis by Simpson's rule. */
static double lit_from_a_position(double x, double y, trip_vec3 light, double g)
{
    enum { STEPS = 2000 };
    const double depth = EDGE - 1;
    double sum = 0;
    for (int n = 0; n <= STEPS; n++) {
        const double t = depth * n / STEPS;
        const trip_vec3 at = trip_v3(x, y, depth - t), way = trip_sub(light, at);
        double cosine = -way.z / trip_length(way);
        double phase = (1 - g * g) / pow(1 + g * g - 2 * g * cosine, 1.5);
        double lit = fmin(1, 0.3 + 0.7 * phase * exp(-FOG * length_in_box(at, light)));
        sum += (n == 0 || n == STEPS ? 1 : n % 2 ? 4 : 2) * FOG * exp(-FOG * t) * lit;
    }
    return sum * depth / STEPS / 3;
}

/* Returns the mean difference of a component. */
static double off(const scene_picture *a, const scene_picture *b)
{
    double sum = 0;
    size_t count = 4 * (size_t)a->width * (size_t)a->height;
    for (size_t i = 0; i < count; i++)
        sum += fabs((double)a->rgba[i] - (double)b->rgba[i]);
    return sum / (double)count;
}

/* Lights beside the fog, above an edge of it, inside it, and on a node of the lattice. */
static void fog_is_lit_from_a_position(void **state)
{
    (void)state;
    const trip_vec3 lights[] = { { 24, 8, 11 }, { 20, 22, 9.5 }, { 6.3, 8.1, 12.7 }, { 15, 9, 4 } };
    scene s;
    create_fog(&s, (float)FOG);
    const trip_camera_params view = along_z(&s);
    for (size_t n = 0; n < sizeof lights / sizeof *lights; n++) {
        trip_settings settings = with_point_light(lights[n]);
        settings.effects.anisotropy = n % 2 ? 0.3 : 0;
        scene_picture exact = integrate(&s, &view, &settings);
        for (int i = 0; i < SIZE * SIZE; i++) {
            trip_vec3 o, d;
            scene_ray(&s, &view, i % SIZE, i / SIZE, &o, &d);
            assert_close(scene_pixel(&exact, i % SIZE, i / SIZE)[0],
                         lit_from_a_position(o.x, o.y, lights[n], settings.effects.anisotropy),
                         5e-5);
        }
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            double apart = scene_difference(&turn.picture, &exact);
            if (!(apart < 0.01 && off(&turn.picture, &exact) < 1e-3))
                fail_msg("light %zu, %s: %g apart", n, turn.renderer->name, apart);
        }
        scene_picture_free(&exact);
    }
    scene_destroy(&s);
}

/* Two slabs across x with a gap between them: voxels 4 to 7 and 13 to 16. */
static bool two_slabs(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)j;
    (void)k;
    (void)gradient;
    *code = (i >= 4 && i <= 7) || (i >= 13 && i <= 16) ? 65535 : 0;
    return true;
}

/* Returns the extinction at x relative to its maximum, and its integral from x on. Extinction is
 * linear between voxels. */
static double slabs_at(double x, double *beyond)
{
    double here = 0;
    *beyond = 0;
    for (int i = 0; i < EDGE; i++) {
        unsigned code;
        two_slabs(NULL, i, 0, 0, &code, NULL);
        double d = x - i, weight = fmax(0, 1 - fabs(d)), half = 0.5 * weight * weight;
        if (!code)
            continue;
        here += weight;
        *beyond += d >= 1 ? 0 : d >= 0 ? half : d > -1 ? 1 - half : 1;
    }
    return here;
}

static void a_box_casts_its_shadow_on_the_next(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = two_slabs });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 1, 1, 1, (float)(0.4 * code / 65535) };
    const trip_camera_params view = along_z(&s);
    const trip_settings settings = scene_with_shadows(trip_v3(1, 0, 0));
    scene_picture exact = integrate(&s, &view, &settings);
    int seen = 0;
    for (int x = 0; x < SIZE; x++) {
        double beyond, here = slabs_at(position_x(&s, &view, x, 4), &beyond);
        double expected = (1 - exp(-0.4 * here * (EDGE - 1))) * (0.3 + 0.7 * exp(-0.4 * beyond));
        assert_close(scene_pixel(&exact, x, 4)[0], expected, 1e-4);
        seen += here > 0;
    }
    assert_true(seen >= 4);
    scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
    while (scene_take_turn(&turn))
        assert_true(scene_difference(&turn.picture, &exact) < 0.01);
    scene_picture_free(&exact);
    scene_destroy(&s);
}

enum { BALL = 33 };

/* A ball of fog with a soft rim. Gradients point away from the centre. */
static bool ball(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const double c = 0.5 * (BALL - 1), d[3] = { i - c, j - c, k - c };
    double r = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    double value = fmin(1, fmax(0, (13 - r) / 4));
    (void)user;
    *code = (unsigned)(65535 * value);
    for (int a = 0; a < 3 && value > 0 && value < 1; a++)
        gradient[a] = -d[a] / r / 4;
    return true;
}

static void create_ball(scene *s, double extinction, const trip_affine *map)
{
    scene_create(s, &(scene_params){ .dims = { BALL, BALL, BALL },
                                     .index_to_world = *map,
                                     .normals = true,
                                     .voxel = ball });
    for (int code = 0; code < 65536; code++)
        s->table[code] = (trip_tf_entry){ 0.9F, 0.6F, 0.3F, (float)(extinction * code / 65535) };
}

/* Lights for the ball: directional, beside the ball, above a corner of its box, and inside it. */
static trip_settings with_light(int number)
{
    const trip_vec3 positions[] = { { 40, 8, 14 }, { 36, 36, -2 }, { 20.4, 12, 16 } };
    return number == 0 ? scene_with_shadows(trip_v3(0.8, -0.3, 0.6))
                       : with_point_light(positions[number - 1]);
}

/* The expected value is a double integral: along the view ray, and from each point towards the
 * light. */
static void the_error_falls_as_the_lattice_becomes_finer(void **state)
{
    (void)state;
    const trip_affine identity = trip_affine_identity();
    for (int n = 0; n < 5; n++) {
        const trip_affine *map = n == 1 ? &scene_sheared : &identity;
        scene s;
        create_ball(&s, 0.15, map);
        const trip_camera_params view = scene_view(&s, trip_v3(0.4, -1, 0.5), 90, 40, SIZE);
        trip_settings settings = with_light(n > 0 ? n - 1 : 0);
        settings.tolerance = 1e-4;
        settings.effects.anisotropy = 0.3;
        scene_picture exact = integrate(&s, &view, &settings);
        double before = 1;
        for (int cells = 8; cells <= 32; cells *= 2) {
            settings.effects.cells = cells;
            scene_picture p = scene_draw(&s, &scene_renderers()[0], &view, &settings);
            double error = off(&p, &exact);
            if (!(error < before / 1.8))
                fail_msg("light %d, %d cells: %g, before %g", n, cells, error, before);
            before = error;
            scene_picture_free(&p);
        }
        assert_true(before < 1e-3);
        scene_picture_free(&exact);
        scene_destroy(&s);
    }
}

static void a_distant_light_equals_a_directional_light(void **state)
{
    (void)state;
    scene s;
    create_ball(&s, 0.15, &scene_sheared);
    const trip_camera_params view = scene_view(&s, trip_v3(0.4, -1, 0.5), 90, 40, SIZE);
    trip_settings direction = scene_with_shadows(trip_v3(0.8, -0.3, 0.6));
    direction.shading = true;
    for (double far = 1e7; far < 1e13; far *= 1e5) {
        trip_settings position = with_point_light(trip_scale(direction.light_direction, far));
        position.shading = true;
        for (int i = 0; i < 3; i++) {
            scene_picture a = i < 2 ? scene_draw(&s, &scene_renderers()[i], &view, &direction)
                                    : integrate(&s, &view, &direction);
            scene_picture b = i < 2 ? scene_draw(&s, &scene_renderers()[i], &view, &position)
                                    : integrate(&s, &view, &position);
            double apart = scene_difference(&a, &b);
            if (!(apart < 1e-4))
                fail_msg("renderer %d, at %g: %g apart", i, far, apart);
            scene_picture_free(&a);
            scene_picture_free(&b);
        }
    }
    scene_destroy(&s);
}

static void openness_is_the_mean_over_directions(void **state)
{
    (void)state;
    scene s;
    const trip_affine map = trip_affine_identity();
    create_ball(&s, 0.15, &map);
    const trip_camera_params view = scene_view(&s, trip_v3(0.4, -1, 0.5), 90, 40, 5);
    trip_settings settings = scene_with_shadows(trip_v3(1, 0, 0));
    settings.effects.shadows = false;
    settings.effects.occlusion = true;
    settings.tolerance = 1e-2;
    scene_picture exact = integrate(&s, &view, &settings);
    scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
    while (scene_take_turn(&turn))
        assert_true(scene_difference(&turn.picture, &exact) < 0.015);
    settings.effects.occlusion = false;
    scene_picture plain = scene_draw(&s, &scene_renderers()[0], &view, &settings);
    assert_true(scene_difference(&exact, &plain) > 0.05);
    scene_picture_free(&plain);
    scene_picture_free(&exact);
    scene_destroy(&s);
}

static void every_renderer_draws_the_effects_alike(void **state)
{
    (void)state;
    scene s;
    create_ball(&s, 0.6, &scene_sheared);
    trip_camera_params view = scene_view(&s, trip_v3(0.4, -1, 0.5), 60, 50, 24);
    for (int n = 0; n < 16; n++) {
        trip_settings settings = with_light(n / 8 * (1 + n / 2 % 3));
        settings.light_position = trip_affine_point(&scene_sheared, settings.light_position);
        settings.classify = n & 1 ? TRIP_CLASSIFY_POST : TRIP_CLASSIFY_PRE;
        settings.shading = n & 2;
        settings.effects.occlusion = n & 4;
        settings.effects.cueing = n & 4 ? 0.5 : 0;
        settings.effects.anisotropy = -0.3;
        view.ortho_height = n & 2 ? 50 : 0;
        scene_picture reference = scene_draw(&s, &scene_renderers()[0], &view, &settings);
        scene_turn turn = scene_turns(scene_renderers() + 1, &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            double apart = scene_difference(&turn.picture, &reference);
            if (!(apart < turn.renderer->tolerance))
                fail_msg("%s, %d: %g apart", turn.renderer->name, n, apart);
        }
        scene_picture_free(&reference);
    }
    scene_destroy(&s);
}

/* Views from afar, from near, and in parallel projection. */
static void every_renderer_fades_with_depth(void **state)
{
    (void)state;
    scene s;
    create_ball(&s, 0.6, &scene_sheared);
    for (int n = 0; n < 8; n++) {
        trip_camera_params view =
            scene_view(&s, trip_v3(0.4, -1, 0.5), n < 4 ? 60 : 25, 50 + 5 * n, 24);
        view.ortho_height = n == 2 || n == 5 ? 50 : 0;
        trip_settings settings = trip_settings_default();
        settings.classify = n & 1 ? TRIP_CLASSIFY_POST : TRIP_CLASSIFY_PRE;
        settings.shading = n & 2;
        settings.depth = n == 3;
        settings.background[0] = 0.7;
        settings.background[1] = 0.4;
        scene_picture plain = scene_draw(&s, &scene_renderers()[0], &view, &settings);
        settings.effects.cueing = 0.8;
        scene_picture expected = scene_draw(&s, &scene_renderers()[0], &view, &settings);
        assert_true(scene_difference(&expected, &plain) > 0.05);
        scene_turn turn = scene_turns(scene_renderers() + 1, &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            double apart = scene_difference(&turn.picture, &expected);
            if (!(apart <= turn.renderer->tolerance))
                fail_msg("%s, %d: %g apart", turn.renderer->name, n, apart);
        }
        scene_picture_free(&plain);
        scene_picture_free(&expected);
    }
    scene_destroy(&s);
}

static int create_single(trip_renderer **out, trip_budget *budget)
{
    return trip_cpu_create(out, budget, 1);
}

static void threads_and_slots_change_no_bit(void **state)
{
    (void)state;
    scene s;
    const trip_affine map = trip_affine_identity();
    create_ball(&s, 0.6, &map);
    const trip_camera_params view = scene_view(&s, trip_v3(0.4, -1, 0.5), 60, 50, 40);
    const scene_renderer single = { "cpu", create_single, 0 };
    for (int n = 0; n < 2; n++) {
        trip_settings settings = scene_with_shadows(trip_v3(0.8, -0.3, 0.6));
        settings.classify = n ? TRIP_CLASSIFY_POST : TRIP_CLASSIFY_PRE;
        settings.effects.occlusion = settings.shading = true;
        scene_picture a = scene_draw(&s, &scene_renderers()[1], &view, &settings);
        scene_picture b = scene_draw_with(
            &s, &single, &view, &settings,
            &(trip_reader_params){ .engine = TRIP_ENGINE_PREAD, .slots = 2, .buffered = true });
        assert_memory_equal(a.rgba, b.rgba, 4 * 40 * 40 * sizeof *a.rgba);
        scene_picture_free(&a);
        scene_picture_free(&b);
    }
    scene_destroy(&s);
}

/* An almost transparent volume casts no shadow and occludes nothing. */
static void effects_change_nothing_in_a_transparent_volume(void **state)
{
    (void)state;
    scene s;
    const trip_affine map = trip_affine_identity();
    create_ball(&s, 1e-4, &map);
    const trip_camera_params view = scene_view(&s, trip_v3(0.4, -1, 0.5), 60, 50, 16);
    for (int n = 0; n < 4; n++) {
        trip_settings settings = scene_with_shadows(trip_v3(0.8, -0.3, 0.6));
        settings.classify = n & 1 ? TRIP_CLASSIFY_POST : TRIP_CLASSIFY_PRE;
        settings.shading = n & 2;
        settings.effects.occlusion = true;
        trip_settings plain = settings;
        plain.effects = (trip_effects){ .cells = TRIP_LIGHT_CELLS };
        scene_turn turn = scene_turns(scene_renderers() + 1, &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            scene_picture without = scene_draw(&s, turn.renderer, &view, &plain);
            assert_true(scene_difference(&turn.picture, &without) < 1e-5);
            scene_picture_free(&without);
        }
    }
    scene_destroy(&s);
}

/* An opaque wall across the view, at voxel *user along z. */
static bool wall(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)i;
    (void)j;
    (void)gradient;
    *code = k <= *(int *)user ? 65535 : 0;
    return true;
}

static void farther_voxels_fade_into_the_background(void **state)
{
    (void)state;
    for (int at = 3; at < EDGE; at += 6) {
        scene s;
        scene_create(&s,
                     &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = wall, .user = &at });
        for (int code = 0; code < 65536; code++)
            s.table[code] = (trip_tf_entry){ 1, 0.5F, 0, code > 65000 ? 50 : 0 };
        const trip_camera_params view = along_z(&s);
        trip_settings settings = scene_with_shadows(trip_v3(1, 0, 0));
        settings.effects.shadows = false;
        settings.effects.cueing = 0.8;
        settings.background[2] = 1;
        const double far = (double)(EDGE - 1 - at) / (EDGE - 1), f = 0.8 * far;
        for (int n = 0; n < 3; n++) {
            scene_picture p = n < 2 ? scene_draw(&s, &scene_renderers()[n], &view, &settings)
                                    : integrate(&s, &view, &settings);
            const float *c = scene_pixel(&p, 4, 4);
            assert_close(c[0], 1 - f, 0.8 * 0.3 / (EDGE - 1));
            assert_close(c[1], 0.5 * (1 - f), 0.8 * 0.3 / (EDGE - 1));
            assert_close(c[2], f, 0.8 * 0.3 / (EDGE - 1));
            scene_picture_free(&p);
        }
        scene_destroy(&s);
    }
}

/* Returns the depth cueing of a box of voxels for an eye. */
static trip_effects_view fading(trip_vec3 eye, trip_vec3 look, const uint64_t dims[3])
{
    const trip_affine map = trip_affine_identity();
    const trip_camera_params view = { .eye = eye,
                                      .look = look,
                                      .up = { 0, 1, 0 },
                                      .fov_degrees = 30,
                                      .width = SIZE,
                                      .height = SIZE };
    trip_settings settings = trip_settings_default();
    trip_camera camera;
    settings.effects.cueing = 1;
    assert_int_equal(trip_camera_make(&camera, &view, &map), 0);
    return trip_effects_view_make(&settings, &camera, dims);
}

/* The eye is in the centre of the box. */
static void inside_the_volume_fading_begins_at_the_eye(void **state)
{
    (void)state;
    const uint64_t dims[3] = { 21, 21, 21 };
    const trip_effects_view e = fading(trip_v3(10, 10, 10), trip_v3(10, 10, 0), dims);
    for (int k = 0; k <= 10; k++)
        assert_close(e.cue[0] * 3 + e.cue[1] * 4 + e.cue[2] * k + e.cue[3], 1 - k / 10.0, 1e-12);
}

/* The distance depends on the lattice's cells, four voxels of 0.5 each. */
static void light_is_looked_up_beside_surfaces_by_the_lattices_cells(void **state)
{
    (void)state;
    const uint64_t dims[3] = { 201, 101, 51 };
    const trip_affine map = { { { 0.5, 0, 0, 0 }, { 0, 0.5, 0, 0 }, { 0, 0, 0.5, 0 } } };
    const trip_camera_params view = {
        .eye = { 0, 0, 300 }, .up = { 0, 1, 0 }, .fov_degrees = 30, .width = SIZE, .height = SIZE
    };
    trip_settings settings = scene_with_shadows(trip_v3(1, 0, 0));
    trip_camera camera;
    settings.effects.cells = 50;
    assert_int_equal(trip_camera_make(&camera, &view, &map), 0);
    assert_close(trip_effects_view_make(&settings, &camera, dims).bias, TRIP_LIGHT_BIAS * 4 * 0.5,
                 1e-12);
}

static double note_position(const void *user, trip_vec3 voxel)
{
    *(trip_vec3 *)(size_t)user = voxel;
    return 1;
}

/* Beside a surface, light is looked up three voxels nearer to the light, but not beyond the light.
 */
static void light_is_not_looked_up_beyond_its_position(void **state)
{
    (void)state;
    trip_vec3 asked = { 0, 0, 0 };
    trip_effects_view e = { .effects = { .shadows = true },
                            .to_index = trip_affine_identity(),
                            .bias = 3,
                            .point_light = true,
                            .user = &asked,
                            .reached = note_position };
    const trip_light light = {
        .eye = { 0, 0, 1 }, .light = { 0, 0.6, 0.8 }, .half = { 0, 0.6, 0.8 }, .gradient_full = 1
    };
    const double gradient[3] = { 0, 0, 2 };
    for (int distance = 1; distance < 10; distance++) {
        double rgb[3] = { 1, 1, 1 };
        const double by = fmin(3, distance);
        e.light = trip_v3(5, 0.6 * distance, 7 + 0.8 * distance);
        trip_effects_colour(&e, &light, trip_v3(5, 0, 7), gradient, rgb);
        assert_close(asked.x, 5, 1e-12);
        assert_close(asked.y, 0.6 * by, 1e-12);
        assert_close(asked.z, 7 + 0.8 * by, 1e-12);
    }
}

/* Test functions of position: the light that reaches a point, and the openness there. */
static double test_reached(const void *user, trip_vec3 v)
{
    (void)user;
    return 0.5 + 0.4 * sin(v.x + 2 * v.y - v.z);
}

static double test_open(const void *user, trip_vec3 v)
{
    (void)user;
    return 0.5 + 0.45 * sin(2 * v.x - v.y + 1.5 * v.z);
}

/* The formula of effects.h for a component of a colour lit by a directional light. */
static double lit_component(const trip_effects_view *e, const trip_light *at, trip_vec3 x,
                            const double *gradient, double c)
{
    const trip_lit lit = gradient ? trip_light_on(at, gradient) : (trip_lit){ 0 };
    const double g = e->effects.anisotropy, strength = lit.strength;
    double reached = 1, open = 1, phase = 1;
    if (e->effects.shadows) {
        const trip_vec3 aside = trip_scale(at->light, strength * e->bias);
        const double cosine = trip_dot(trip_scale(at->light, -1), at->eye);
        reached = test_reached(NULL, trip_add(x, trip_affine_vector(&e->to_index, aside)));
        phase = (1 - g * g) / pow(1 + g * g - 2 * g * cosine, 1.5);
    }
    if (e->effects.occlusion) {
        const trip_vec3 n =
            gradient ? trip_v3(gradient[0], gradient[1], gradient[2]) : trip_v3(1, 0, 0);
        const trip_vec3 aside =
            trip_affine_vector(&e->to_index, trip_scale(n, strength * e->bias / trip_length(n)));
        open = fmin(1, (1 + strength) * fmax(test_open(NULL, trip_add(x, aside)),
                                             test_open(NULL, trip_sub(x, aside))));
    }
    const double all =
        c * (TRIP_AMBIENT * open +
             TRIP_DIFFUSE * reached * ((1 - strength) * phase + strength * lit.diffuse)) +
        strength * reached * TRIP_SPECULAR * lit.specular;
    return fmin(1, fmax(0, all));
}

/* Without shading, with partial and full shading; with shadows, with occlusion, and with both. */
static void colours_are_those_of_the_formula(void **state)
{
    (void)state;
    int full = 0, bright = 0, changed = 0;
    trip_effects_view e = { .bias = 0.7, .reached = test_reached, .open = test_open };
    assert_true(trip_affine_invert(&scene_sheared, &e.to_index));
    for (int n = 0; n < 3000; n++) {
        const trip_vec3 x = trip_v3(9 * test_random(), 9 * test_random(), 9 * test_random());
        const trip_vec3 eye = trip_effects_direction(n % TRIP_OPEN_DIRECTIONS);
        const trip_vec3 light = trip_effects_direction(n * 7 % 29);
        const trip_light at = { .eye = eye,
                                .light = light,
                                .half = trip_normalize(trip_add(eye, light)),
                                .gradient_full = 1 };
        const trip_vec3 g = trip_scale(at.half, 1.5 * test_random());
        const double turned[3] = { g.x + 0.3 * test_random(), g.y, g.z - 0.3 * test_random() };
        const double *gradient = n % 5 ? turned : NULL;
        e.effects = (trip_effects){ .shadows = n % 3 != 1,
                                    .occlusion = n % 3 > 0,
                                    .anisotropy = 0.8 * sin(n) };
        double rgb[3] = { 1, 0.6 * test_random(), 0 };
        const double c[3] = { rgb[0], rgb[1], rgb[2] };
        trip_effects_colour(&e, &at, x, gradient, rgb);
        for (int i = 0; i < 3; i++)
            assert_close(rgb[i], lit_component(&e, &at, x, gradient, c[i]), 1e-12);
        full += gradient && trip_light_on(&at, gradient).strength == 1;
        bright += rgb[0] == 1;
        changed += fabs(rgb[0] - c[0]) > 0.1;
    }
    assert_true(full > 100 && bright > 100 && changed > 1000);
}

/* Returns corner `n` of a box of voxels in index space. The voxels differ in length along the
 * three axes. */
static const uint64_t box_dims[3] = { 21, 31, 41 };

static trip_vec3 box_corner(int n)
{
    return trip_v3(n & 1 ? 20 : 0, n & 2 ? 30 : 0, n & 4 ? 40 : 0);
}

/* Cueing depends on the distance along the view direction in world space. It is 0 at the nearest
 * corner before the eye, or at the eye, and 1 at the farthest corner. */
static void fading_goes_from_the_nearest_corner_to_the_farthest(void **state)
{
    (void)state;
    for (int n = 0; n < 60; n++) {
        const trip_vec3 middle = trip_affine_point(&scene_sheared, trip_v3(10, 15, 20));
        const trip_vec3 view_direction = trip_effects_direction(n % TRIP_OPEN_DIRECTIONS);
        const trip_camera_params view = { .eye = trip_sub(
                                              middle, trip_scale(view_direction, n % 3 ? 90 : 5)),
                                          .look = trip_add(middle, view_direction),
                                          .up = { 0.1, 0.2, 0.3 },
                                          .fov_degrees = 30,
                                          .ortho_height = n % 2 ? 50 : 0,
                                          .width = SIZE,
                                          .height = SIZE };
        trip_settings settings = trip_settings_default();
        trip_camera camera;
        double z[8], near = INFINITY, far = 0;
        settings.effects.cueing = 1;
        for (int i = 0; i < 8; i++) {
            const trip_vec3 corner = trip_affine_point(&scene_sheared, box_corner(i));
            z[i] = trip_dot(view_direction, trip_sub(corner, view.eye));
            near = fmin(near, fmax(0, z[i]));
            far = fmax(far, z[i]);
        }
        assert_int_equal(trip_camera_make(&camera, &view, &scene_sheared), 0);
        const trip_effects_view e = trip_effects_view_make(&settings, &camera, box_dims);
        for (int i = 0; i < 8; i++) {
            const trip_vec3 c = box_corner(i);
            assert_close(e.cue[0] * c.x + e.cue[1] * c.y + e.cue[2] * c.z + e.cue[3],
                         (z[i] - near) / (far - near), 1e-9);
        }
    }
}

/* If the whole box lies behind the eye, no part of it fades. */
static void volumes_behind_the_eye_do_not_fade(void **state)
{
    (void)state;
    const trip_effects_view e = fading(trip_v3(10, 15, 50), trip_v3(10, 15, 60), box_dims);
    for (int i = 0; i < 4; i++)
        assert_true(e.cue[i] == 0);
}

/* The linear form is below 0 and above 1 at some positions. */
static void fading_blends_with_the_background_by_its_share(void **state)
{
    (void)state;
    const trip_effects_view e = { .effects = { .cueing = 0.8 },
                                  .cue = { 0.1, 0.25, -0.15, 0.2 },
                                  .cue_rgb = { 0.9, 0.1, 0.4 } };
    const trip_light light = { .gradient_full = 1 };
    int below = 0, above = 0;
    for (int n = 0; n < 500; n++) {
        const trip_vec3 x = trip_v3(9 * test_random(), 9 * test_random(), 9 * test_random());
        const double form = 0.1 * x.x + 0.25 * x.y - 0.15 * x.z + 0.2;
        const double share = 0.8 * fmin(1, fmax(0, form));
        const double c[3] = { test_random(), test_random(), test_random() };
        double rgb[3] = { c[0], c[1], c[2] };
        trip_effects_colour(&e, &light, x, NULL, rgb);
        for (int i = 0; i < 3; i++)
            assert_close(rgb[i], c[i] * (1 - share) + e.cue_rgb[i] * share, 1e-12);
        below += form < 0;
        above += form > 1;
    }
    assert_true(below > 10 && above > 10);
}

static void scattering_keeps_light(void **state)
{
    (void)state;
    enum { STEPS = 20000 };
    for (double g = -0.9; g < 0.95; g += 0.3) {
        double sum = 0;
        for (int n = 0; n < STEPS; n++)
            sum += trip_effects_phase(g, (2 * n + 1.0) / STEPS - 1) / STEPS;
        assert_close(sum, 1, 1e-4);
    }
}

static void directions_are_spread_evenly(void **state)
{
    (void)state;
    trip_vec3 sum = { 0, 0, 0 };
    for (int n = 0; n < TRIP_OPEN_DIRECTIONS; n++) {
        trip_vec3 d = trip_effects_direction(n);
        assert_close(trip_length(d), 1, 1e-12);
        sum = trip_add(sum, d);
        for (int m = 0; m < n; m++)
            assert_true(trip_dot(d, trip_effects_direction(m)) < 0.95);
    }
    assert_true(trip_length(sum) / TRIP_OPEN_DIRECTIONS < 0.02);
    assert_close(sum.z, 0, 1e-12); /* every direction above has one equally far below */
}

/* A second frame with another view reads nothing. Another light takes one sweep. Another transfer
 * function recomputes everything. */
static void the_lattice_is_kept_until_something_changes(void **state)
{
    (void)state;
    scene s;
    trip_light_map *m;
    const trip_affine map = trip_affine_identity();
    const trip_clip none = { 0 };
    create_ball(&s, 0.6, &map);
    trip_settings settings = scene_with_shadows(trip_v3(0.8, -0.3, 0.6));
    const trip_light_source source = {
        .data = s.data, .settings = &settings, .clip = &none, .table = s.table, .threads = 1
    };
    assert_int_equal(trip_light_map_create(&m, s.budget), 0);
    for (int n = 0; n < 4; n++) {
        if (n == 2)
            settings.light_direction = trip_v3(0, 1, 0);
        if (n == 3)
            s.table[40000].extinction *= 2;
        assert_int_equal(trip_light_map_begin(m, &source), 0);
        int status;
        assert_true(trip_light_map_is_complete(m) == (n == 1));
        while ((status = trip_light_map_step(m, NULL)) > 0)
            trip_light_map_await(m, UINT64_MAX);
        assert_int_equal(status, TRIP_FRAME_DONE);
        assert_true((trip_light_map_stats(m).bytes_read > 0) == (n == 0 || n == 3));
    }
    trip_light_map_destroy(m);
    scene_destroy(&s);
}

static void complete(trip_light_map *m, const trip_light_source *source)
{
    assert_int_equal(trip_light_map_begin(m, source), 0);
    while (trip_light_map_step(m, NULL) > 0)
        trip_light_map_await(m, UINT64_MAX);
    assert_true(trip_light_map_is_complete(m));
}

/* Every mean of constant fog is the same, also at nodes beyond the last voxels. */
static void a_coarse_lattice_has_the_extinction_of_even_fog_at_every_node(void **state)
{
    (void)state;
    scene s;
    trip_light_map *m;
    const trip_clip none = { 0 };
    create_fog(&s, FOG);
    trip_settings settings = scene_with_shadows(trip_v3(0, 0, 1));
    const trip_light_source source = {
        .data = s.data, .settings = &settings, .clip = &none, .table = s.table, .threads = 1
    };
    assert_int_equal(trip_light_map_create(&m, s.budget), 0);
    for (int cells = 3; cells < EDGE; cells++) {
        settings.effects.cells = cells;
        complete(m, &source);
        const trip_light_grid *g = trip_light_map_gathered(m);
        for (size_t n = 0; n < trip_light_grid_count(g); n++)
            assert_close((double)g->at[n], FOG, 1e-6);
    }
    trip_light_map_destroy(m);
    scene_destroy(&s);
}

/* One half of the grid along i, selected by *user, with the adjacent sheet of the other half. */
static bool half_fog(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)j, (void)k, (void)gradient;
    *code = 65535;
    return (i < EDGE / 2) == (*(const int *)user == 0);
}

static bool beside_half_fog(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)j, (void)k, (void)gradient;
    *code = 65535;
    return i == (*(const int *)user == 0 ? EDGE / 2 : EDGE / 2 - 1);
}

/* A voxel that is halo in one data set and kept in the other counts once. */
static void joined_data_sets_make_one_fog(void **state)
{
    (void)state;
    scene halves[2];
    trip_dataset *joined;
    trip_light_map *m;
    const trip_clip none = { 0 };
    for (int n = 0; n < 2; n++) {
        const scene_part halo = {
            .kind = TRIP_KIND_HALO, .by = { 1, 1, 1 }, .voxel = beside_half_fog, .user = &n
        };
        scene_create(&halves[n], &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                                  .voxel = half_fog,
                                                  .user = &n,
                                                  .parts = &halo,
                                                  .part_count = 1 });
        halves[n].table[65535] = (trip_tf_entry){ 1, 1, 1, (float)FOG };
    }
    trip_dataset *const parts[2] = { halves[0].data, halves[1].data };
    assert_int_equal(trip_dataset_join(&joined, parts, 2, halves[0].budget), 0);
    for (int n = 0; n < 6; n++) {
        trip_settings settings = scene_with_shadows(trip_v3(n / 2 == 0, n / 2 == 1, n / 2 == 2));
        settings.classify = n % 2 ? TRIP_CLASSIFY_POST : TRIP_CLASSIFY_PRE;
        const trip_light_source source = { .data = joined,
                                           .settings = &settings,
                                           .clip = &none,
                                           .table = halves[0].table,
                                           .threads = 1 };
        assert_int_equal(trip_light_map_create(&m, halves[0].budget), 0);
        complete(m, &source);
        const trip_light_grid *g = trip_light_map_gathered(m);
        for (size_t i = 0; i < trip_light_grid_count(g); i++)
            assert_close((double)g->at[i], FOG, 1e-6);
        trip_light_map_destroy(m);
    }
    trip_dataset_join_close(joined);
    scene_destroy(&halves[0]);
    scene_destroy(&halves[1]);
}

/* At the rim of the fog, some columns near the node have already left the fog. */
static bool is_on_rim(trip_vec3 node)
{
    for (int a = 0; a < 3; a++)
        if (trip_component(node, a) < 1 || trip_component(node, a) > EDGE - 2)
            return true;
    return false;
}

/* Compares the transmittance at `position` with the mean of two points of the line through it,
 * weighted by distance. The points are one apart, and the first is `part` before `position`.
 * Returns the difference. */
static double mean_is_off(trip_vec3 position, trip_vec3 along, double part, trip_vec3 light)
{
    const trip_vec3 before = trip_sub(position, trip_scale(along, part));
    const double mean = (1 - part) * exp(-FOG * length_in_box(before, light)) +
                        part * exp(-FOG * length_in_box(trip_add(before, along), light));
    return fabs(mean - exp(-FOG * length_in_box(position, light)));
}

/* Returns the maximum error of a node in fog. Columns are exact, and at most one node apart in a
 * layer. Linear interpolation between two columns causes the error, wherever they lie, along both
 * axes of the layer. */
static double max_off(trip_vec3 node, trip_vec3 light)
{
    const trip_vec3 way = trip_sub(node, light),
                    axes[3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };
    const double rounding = 1e-6;
    double sum = rounding;
    int longest = 0;
    for (int a = 1; a < 3; a++)
        if (fabs(trip_component(way, a)) > fabs(trip_component(way, longest)))
            longest = a;
    for (int i = 1; i < 3; i++) {
        double max = 0;
        for (int n = 1; n < 8; n++)
            max = fmax(max, mean_is_off(node, axes[(longest + i) % 3], n / 8.0, light));
        sum += max;
    }
    return sum;
}

/* In constant fog the light at each node is known. Outside the fog it is 1 to the last bit, in
 * every region. */
static void every_node_is_lit_from_a_position_once(void **state)
{
    (void)state;
    const double c = 0.5 * (EDGE - 1), last = EDGE - 1;
    const trip_vec3 lights[] = { { c, c, c },    { 4, 4, 4 },       { 4, 4, 9 },   { 0, 0, 0 },
                                 { last, 0, 7 }, { 30, 30, 30 },    { -1, 9, 9 },  { 5.5, 40, 5.5 },
                                 { 9, 9, -1e9 }, { last, last, 9 }, { -7, 26, 3 }, { 0.5, 0, 19 } };
    const trip_clip none = { 0 };
    for (int fog = 0; fog < 2; fog++) {
        scene s;
        trip_light_map *m;
        create_fog(&s, fog ? (float)FOG : 0);
        assert_int_equal(trip_light_map_create(&m, s.budget), 0);
        for (size_t n = 0; n < sizeof lights / sizeof *lights; n++) {
            const trip_settings settings = with_point_light(lights[n]);
            complete(m, &(trip_light_source){ .data = s.data,
                                              .settings = &settings,
                                              .clip = &none,
                                              .table = s.table,
                                              .threads = 1 });
            const float *reached = trip_light_map_reached(m)->at;
            for (int i = 0; i < EDGE * EDGE * EDGE; i++) {
                const trip_vec3 node = trip_v3(i % EDGE, i / EDGE % EDGE, i / EDGE / EDGE);
                const double expected = exp(-fog * FOG * length_in_box(node, lights[n]));
                double apart = fabs((double)reached[i] - expected);
                if (!(fog && is_on_rim(node)) && !(apart <= (fog ? max_off(node, lights[n]) : 0)))
                    fail_msg("light %zu, node %g %g %g: %g, not %g", n, node.x, node.y, node.z,
                             (double)reached[i], expected);
            }
        }
        trip_light_map_destroy(m);
        scene_destroy(&s);
    }
}

/* Runs the last task first. */
static void run_backwards(void *user, void (*task)(void *context, unsigned number), void *context,
                          unsigned count)
{
    *(unsigned *)user += count;
    while (count-- > 0)
        task(context, count);
}

static void assert_same_lattice(const trip_light_grid *a, const trip_light_grid *b)
{
    assert_memory_equal(a->at, b->at, trip_light_grid_count(a) * sizeof *a->at);
}

static void the_lattice_has_the_same_bits_for_any_order_of_tasks(void **state)
{
    (void)state;
    scene s;
    trip_light_map *maps[2];
    const trip_affine map = trip_affine_identity();
    const trip_clip none = { 0 };
    create_ball(&s, 0.6, &map);
    trip_settings settings = scene_with_shadows(trip_v3(0.3, -0.8, 0.5));
    settings.effects.occlusion = true;
    const trip_light_source source = {
        .data = s.data, .settings = &settings, .clip = &none, .table = s.table, .threads = 1
    };
    unsigned tasks = 0;
    const trip_task_runner runner = { run_backwards, &tasks };
    for (int n = 0; n < 2; n++) {
        assert_int_equal(trip_light_map_create(&maps[n], s.budget), 0);
        assert_int_equal(trip_light_map_begin(maps[n], &source), 0);
        while (trip_light_map_step(maps[n], n ? &runner : NULL) > 0)
            trip_light_map_await(maps[n], UINT64_MAX);
        assert_true(trip_light_map_is_complete(maps[n]));
    }
    assert_same_lattice(trip_light_map_open(maps[0]), trip_light_map_open(maps[1]));
    assert_same_lattice(trip_light_map_reached(maps[0]), trip_light_map_reached(maps[1]));
    assert_true(tasks > 1000);
    trip_light_map_destroy(maps[0]);
    trip_light_map_destroy(maps[1]);
    scene_destroy(&s);
}

/* A step computes at most 16384 columns or nodes of a layer, so that a frame can be cancelled
 * soon. */
static void a_wide_layer_takes_several_steps(void **state)
{
    (void)state;
    enum { WIDE = 200, LAYERS = 9, LAYER_NODES = WIDE * WIDE, PIECES = 6, STEPS = 3 };
    scene s;
    trip_light_map *m;
    const trip_clip none = { 0 };
    scene_create(&s, &(scene_params){ .dims = { WIDE, WIDE, LAYERS }, .tile_voxels = 64 });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 1, 1, 1, (float)FOG };
    trip_settings settings = scene_with_shadows(trip_v3(0, 0, 1));
    settings.effects.cells = WIDE;
    const trip_light_source source = {
        .data = s.data, .settings = &settings, .clip = &none, .table = s.table, .threads = 1
    };
    int sweeps = 0;
    assert_int_equal(trip_light_map_create(&m, s.budget), 0);
    assert_int_equal(trip_light_map_begin(m, &source), 0);
    while (trip_light_map_step(m, NULL) > 0) {
        sweeps += trip_light_map_stats(m).sweep_ms > 0;
        trip_light_map_await(m, UINT64_MAX);
    }
    assert_true(sweeps >= PIECES + 2 * STEPS * LAYERS);
    const trip_light_grid *reached = trip_light_map_reached(m);
    assert_int_equal(trip_light_grid_count(reached), LAYER_NODES * LAYERS);
    for (int n = 0; n < LAYER_NODES * LAYERS; n++)
        assert_close(reached->at[n], exp(-FOG * (LAYERS - 1 - n / LAYER_NODES)), 1e-6);
    trip_light_map_destroy(m);
    scene_destroy(&s);
}

/* A step averages or clears a limited number of nodes. If a frame is cancelled, the next one does
 * the remaining steps. */
static void a_lattice_of_many_nodes_takes_many_steps(void **state)
{
    (void)state;
    enum { NODES = 80, COUNT = NODES * NODES * NODES, OPEN_NODES = NODES / 2 + 1 };
    enum { PIECES = 8, OPEN_PIECES = 2 }; /* of about 65536 nodes each */
    scene s;
    trip_light_map *maps[2];
    const trip_clip none = { 0 };
    scene_create(&s, &(scene_params){ .dims = { NODES, NODES, NODES }, .tile_voxels = 64 });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 1, 1, 1, (float)FOG };
    trip_settings settings = scene_with_shadows(trip_v3(0.3, -0.8, 0.5));
    settings.effects.cells = NODES;
    settings.effects.occlusion = true;
    const trip_light_source source = {
        .data = s.data, .settings = &settings, .clip = &none, .table = s.table, .threads = 1
    };
    int averages = 0, sweeps = 0;
    for (int n = 0; n < 2; n++) {
        assert_int_equal(trip_light_map_create(&maps[n], s.budget), 0);
        assert_int_equal(trip_light_map_begin(maps[n], &source), 0);
        while (trip_light_map_step(maps[n], NULL) > 0) {
            const trip_light_stats stats = trip_light_map_stats(maps[n]);
            averages += n == 0 && stats.bytes_read > 0 && stats.sweep_ms == 0;
            sweeps += n == 0 && stats.sweep_ms > 0;
            if (n == 1)
                assert_int_equal(trip_light_map_begin(maps[n], &source), 0);
            trip_light_map_await(maps[n], UINT64_MAX);
        }
    }
    /* The first step follows the end of reading. */
    assert_int_equal(averages, 1 + PIECES);
    assert_int_equal(sweeps,
                     PIECES + 2 * NODES + OPEN_PIECES + 2 * OPEN_NODES * TRIP_OPEN_DIRECTIONS);
    const trip_light_grid *means = trip_light_map_gathered(maps[0]);
    assert_int_equal(trip_light_grid_count(means), COUNT);
    for (size_t n = 0; n < COUNT; n++)
        assert_close(means->at[n], FOG, 1e-8);
    assert_same_lattice(means, trip_light_map_gathered(maps[1]));
    assert_same_lattice(trip_light_map_reached(maps[0]), trip_light_map_reached(maps[1]));
    assert_same_lattice(trip_light_map_open(maps[0]), trip_light_map_open(maps[1]));
    trip_light_map_destroy(maps[0]);
    trip_light_map_destroy(maps[1]);
    scene_destroy(&s);
}

static void a_lattice_that_does_not_fit_is_refused(void **state)
{
    (void)state;
    scene s;
    trip_light_map *m;
    const trip_affine map = trip_affine_identity();
    const trip_clip none = { 0 };
    create_ball(&s, 0.6, &map);
    const trip_settings settings = scene_with_shadows(trip_v3(0.8, -0.3, 0.6));
    const trip_light_source source = {
        .data = s.data, .settings = &settings, .clip = &none, .table = s.table, .threads = 1
    };
    assert_int_equal(trip_light_map_create(&m, s.budget), 0);
    uint64_t max = trip_budget_left_bytes(s.budget) - 100000;
    assert_true(trip_budget_charge(s.budget, max));
    test_catch_reports();
    assert_true(trip_light_map_begin(m, &source) < 0);
    assert_one_report("33 x 33 x 33 nodes");
    trip_budget_discharge(s.budget, max);
    trip_light_map_destroy(m);
    scene_destroy(&s);
}

static void a_renderer_without_effects_refuses_them(void **state)
{
    (void)state;
    const trip_renderer_ops ops = { .name = "plain", .classifies_post = true };
    trip_renderer plain = { .ops = &ops };
    trip_drawing drawing;
    trip_camera camera;
    trip_plan plan;
    trip_reader *reader;
    scene s;
    create_fog(&s, (float)FOG);
    const trip_camera_params view = along_z(&s);
    trip_settings settings = scene_with_shadows(trip_v3(0, 0, 1));
    const trip_effects refused[] = { { .cueing = 0.5 },
                                     { .occlusion = true },
                                     { .emission = true } };
    assert_int_equal(trip_camera_make(&camera, &view, &s.data->index_to_world), 0);
    assert_int_equal(trip_plan_make(&plan, s.data, &camera, &settings, s.table, s.budget), 0);
    assert_int_equal(trip_reader_create(&reader, s.data,
                                        &(trip_reader_params){ .planes = plan.planes }, s.budget),
                     0);
    const trip_frame frame = {
        .data = s.data, .camera = &camera, .settings = &settings, .plan = &plan, .table = s.table
    };
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        settings.effects = refused[i];
        settings.effects.cells = TRIP_LIGHT_CELLS;
        test_catch_reports();
        assert_true(trip_frame_begin(&drawing, &plain, reader, &frame) < 0);
        assert_one_report("does not draw effects");
        trip_frame_end(&drawing);
    }
    trip_reader_destroy(reader);
    trip_plan_release(&plan, s.budget);
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fog_lit_from_the_side_is_darker_away_from_the_light),
        cmocka_unit_test(clipped_voxels_cast_no_shadow),
        cmocka_unit_test(the_rest_of_a_clipped_segment_fades_at_its_own_depth),
        cmocka_unit_test(fog_lit_from_the_front_scatters_backwards),
        cmocka_unit_test(fog_is_lit_from_a_position),
        cmocka_unit_test(a_box_casts_its_shadow_on_the_next),
        cmocka_unit_test(a_distant_light_equals_a_directional_light),
        cmocka_unit_test(a_coarse_lattice_has_the_extinction_of_even_fog_at_every_node),
        cmocka_unit_test(joined_data_sets_make_one_fog),
        cmocka_unit_test(every_node_is_lit_from_a_position_once),
        cmocka_unit_test(the_error_falls_as_the_lattice_becomes_finer),
        cmocka_unit_test(openness_is_the_mean_over_directions),
        cmocka_unit_test(every_renderer_draws_the_effects_alike),
        cmocka_unit_test(every_renderer_fades_with_depth),
        cmocka_unit_test(threads_and_slots_change_no_bit),
        cmocka_unit_test(effects_change_nothing_in_a_transparent_volume),
        cmocka_unit_test(farther_voxels_fade_into_the_background),
        cmocka_unit_test(inside_the_volume_fading_begins_at_the_eye),
        cmocka_unit_test(light_is_looked_up_beside_surfaces_by_the_lattices_cells),
        cmocka_unit_test(light_is_not_looked_up_beyond_its_position),
        cmocka_unit_test(colours_are_those_of_the_formula),
        cmocka_unit_test(fading_goes_from_the_nearest_corner_to_the_farthest),
        cmocka_unit_test(volumes_behind_the_eye_do_not_fade),
        cmocka_unit_test(fading_blends_with_the_background_by_its_share),
        cmocka_unit_test(scattering_keeps_light),
        cmocka_unit_test(directions_are_spread_evenly),
        cmocka_unit_test(the_lattice_is_kept_until_something_changes),
        cmocka_unit_test(a_renderer_without_effects_refuses_them),
        cmocka_unit_test(the_lattice_has_the_same_bits_for_any_order_of_tasks),
        cmocka_unit_test(a_wide_layer_takes_several_steps),
        cmocka_unit_test(a_lattice_of_many_nodes_takes_many_steps),
        cmocka_unit_test(a_lattice_that_does_not_fit_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
