/* Pictures of labels with the nearest value (sheet.h): closed forms of boxes, equality with the
 * integral, and no colour that no label has. Every renderer with post-classification must pass. */
#include "scenes.h"
#include "test.h"

#include <stdlib.h>
#include <string.h>

#include "cpu/kernels/isa.h"
#include "shade.h"

enum { EDGE = 16, LABELS = 4 };

/* Codes of the labels. The codes between them are opaque white, which no label is. */
static const unsigned codes[LABELS] = { 0, 20000, 40000, 65535 };

/* Label 3 in a box of label 1. */
static bool nested(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)gradient;
    const bool within = i >= 5 && i <= 9 && j >= 4 && j <= 10 && k >= 4 && k <= 10;
    *code = codes[within ? 3 : 1];
    return true;
}

/* Balls of three labels that touch. With `user`, some voxels are missing. */
static bool balls(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)gradient;
    *code = codes[0];
    for (int n = 0; n < 3; n++) {
        const int x = i - 5 - 3 * n, y = j - 4 - 4 * (n % 2), z = k - 9 + 2 * n;
        *code = x * x + y * y + z * z < 20 ? codes[n + 1] : *code;
    }
    return !user || scene_hash(i, j, k) % 8 > 0;
}

static void colour_labels(scene *s, float extinction)
{
    for (int code = 0; code < 65536; code++)
        s->table[code] = (trip_tf_entry){ 1, 1, 1, 50 };
    s->table[codes[0]] = (trip_tf_entry){ 0, 0, 0, 0 };
    s->table[1] = s->table[codes[0]]; /* cpu takes code 0 for 1 */
    s->table[codes[1]] = (trip_tf_entry){ 1, 0, 0, extinction };
    s->table[codes[2]] = (trip_tf_entry){ 0, 1, 0, 2 * extinction };
    s->table[codes[3]] = (trip_tf_entry){ 0, 0.5F, 1, 3 * extinction };
}

static trip_settings nearest(bool shading)
{
    trip_settings s = scene_post(2);
    s.kernel = TRIP_KERNEL_NEAREST;
    s.shading = shading;
    s.tolerance = 1e-6;
    return s;
}

/* A ray along i passes 4.5 voxels of label 1, 5 of label 3, and 5.5 of label 1. */
static void a_box_within_a_box_ends_half_way_between_voxels(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = nested });
    colour_labels(&s, 0.05F);
    trip_camera_params view = scene_view(&s, trip_v3(-1, 0, 0), 60, 20, 4);
    view.ortho_height = 3;
    const double through[3] = { exp(-0.05F * 4.5), exp(-0.15F * 5.0), exp(-0.05F * 5.5) };
    const double red = 1 - through[0] + through[0] * through[1] * (1 - through[2]);
    const double blue = through[0] * (1 - through[1]);
    const trip_settings settings = nearest(false);
    scene_picture truth = scene_integrate(&s, &view, &settings, &(scene_making){ 0 });
    for (int n = 0; n < 16; n++) {
        assert_close(truth.rgba[4 * n], red, 1e-5);
        assert_close(truth.rgba[4 * n + 1], blue / 2, 1e-5);
        assert_close(truth.rgba[4 * n + 2], blue, 1e-5);
    }
    scene_picture_free(&truth);
    scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
    while (scene_take_turn(&turn))
        for (int n = 0; n < 16; n++) {
            const float *c = turn.picture.rgba + 4 * n;
            assert_close(c[0], red, 1e-5);
            assert_close(c[1], blue / 2, 1e-5);
            assert_close(c[2], blue, 1e-5);
            assert_close(c[3], red + blue, 1e-5);
        }
    scene_destroy(&s);
}

/* Views from outside and from within, in perspective and parallel, along an axis and oblique. */
enum { VIEWS = 6 };
static trip_camera_params view_of(const scene *s, int n)
{
    static const double toward[VIEWS][3] = { { 1, 0.2, -0.3 }, { -1, 0.9, 0.8 },  { 0.3, 1, -0.9 },
                                             { 0.2, 0.1, -1 }, { 0.5, -1, 0.45 }, { 0, 0, 1 } };
    const trip_vec3 d = trip_v3(toward[n][0], toward[n][1], toward[n][2]);
    trip_camera_params view = scene_view(s, d, n == 4 ? 3 : 50, n == 4 ? 80 : 25, 40);
    view.ortho_height = n % 2 ? 22 : 0;
    return view;
}

static void check_palette(const scene_picture *p, int *seen)
{
    static const float palette[LABELS][3] = {
        { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0.5F, 1 }
    };
    for (int n = 0; n < p->width * p->height; n++) {
        const float *c = p->rgba + 4 * n;
        int own = -1;
        for (int l = 0; l < LABELS; l++)
            if (fabsf(c[0] - palette[l][0]) < 0.004F && fabsf(c[1] - palette[l][1]) < 0.004F &&
                fabsf(c[2] - palette[l][2]) < 0.004F)
                own = l;
        if (own < 0)
            print_message("pixel %d: %g %g %g %g\n", n, c[0], c[1], c[2], c[3]);
        assert_true(own >= 0);
        *seen |= 1 << own;
    }
}

/* At an extinction of 1e6 the part of a ray in one voxel is opaque, however short. */
static void opaque_labels_show_no_colour_of_another_value(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = balls });
    colour_labels(&s, 1e6F);
    const trip_settings settings = nearest(false);
    for (int n = 0; n < VIEWS; n++) {
        const trip_camera_params view = view_of(&s, n);
        int seen = 0;
        scene_picture truth = scene_integrate(&s, &view, &settings, &(scene_making){ 0 });
        check_palette(&truth, &seen);
        assert_int_equal(seen, n == 4 ? seen : 15); /* all labels are in view from outside */
        scene_picture_free(&truth);
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn))
            check_palette(&turn.picture, &seen);
    }
    scene_destroy(&s);
}

static double mean_difference(const scene_picture *a, const scene_picture *b)
{
    double sum = 0;
    for (int i = 0; i < 4 * a->width * a->height; i++)
        sum += fabs((double)a->rgba[i] - (double)b->rgba[i]);
    return sum / (4.0 * a->width * a->height);
}

/* Pixels terminate early, so a component may be off by that transmittance, 1/512. */
static void compare_with_integral(const scene *s, const trip_settings *settings)
{
    for (int n = 0; n < VIEWS; n++) {
        const trip_camera_params view = view_of(s, n);
        scene_picture truth = scene_integrate(s, &view, settings, &(scene_making){ 0 });
        assert_true(scene_max_opaque(&truth) > 0.2);
        scene_turn turn = scene_turns(scene_renderers_post(), s, &view, settings);
        while (scene_take_turn(&turn)) {
            const double mean = mean_difference(&turn.picture, &truth);
            if (!(mean < 0.1 / 255))
                print_message("%s, view %d: %g of 255\n", turn.renderer->name, n, 255 * mean);
            assert_true(mean < 0.1 / 255);
        }
        scene_picture_free(&truth);
    }
}

static void every_renderer_equals_the_integral(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        scene s;
        scene_create(
            &s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                 .index_to_world = i % 2 ? scene_sheared : trip_affine_identity(),
                                 .voxel = balls });
        colour_labels(&s, i / 2 ? 30 : 0.1F);
        trip_settings settings = nearest(false);
        compare_with_integral(&s, &settings);
        settings = nearest(true);
        settings.headlight = i < 2;
        settings.light_direction = trip_normalize(trip_v3(1, -2, 0.5));
        trip_clip_add(&settings.clip, trip_v3(0.7, -0.2, 0.6), -4.3);
        compare_with_integral(&s, &settings);
        scene_destroy(&s);
    }
}

static void uneven_grids_equal_the_integral(void **state)
{
    (void)state;
    static double tables[3][EDGE];
    const int64_t voxels[3] = { EDGE, EDGE, EDGE };
    for (int a = 0; a < 3; a++)
        for (int i = 0; i < EDGE; i++)
            tables[a][i] = i + (i > 0 && i < EDGE - 1 ? 0.3 * sin(i * (a + 1)) : 0);
    const trip_coordinates coordinates =
        trip_coordinates_make((const double *const[]){ tables[0], tables[1], tables[2] }, voxels);
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                      .coordinates = &coordinates,
                                      .voxel = balls });
    colour_labels(&s, 0.3F);
    trip_settings settings = nearest(true);
    compare_with_integral(&s, &settings);
    scene_destroy(&s);
}

/* The grid's border, holes, and a light map. */
static void holes_and_effects_agree_with_the_reference(void **state)
{
    (void)state;
    static int holes = 1;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                      .index_to_world = scene_sheared,
                                      .tile_voxels = 16,
                                      .voxel = balls,
                                      .user = &holes });
    colour_labels(&s, 0.4F);
    s.table[codes[0]] = (trip_tf_entry){ 1, 1, 0, 0.1F }; /* the border of the grid is visible */
    s.table[1] = s.table[codes[0]];
    for (int n = 0; n < 2 * VIEWS; n++) {
        const trip_camera_params view = view_of(&s, n % VIEWS);
        trip_settings settings = nearest(true);
        settings.effects.occlusion = n / VIEWS;
        settings.effects.cueing = n / VIEWS ? 0.5 : 0;
        scene_picture expected = { 0 };
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            if (!expected.rgba) {
                expected = scene_draw(&s, turn.renderer, &view, &settings);
                assert_true(scene_max_opaque(&expected) > 0.2);
                continue;
            }
            const double mean = mean_difference(&turn.picture, &expected);
            if (!(mean < 0.02 / 255))
                print_message("%s, view %d: %g of 255\n", turn.renderer->name, n, 255 * mean);
            assert_true(mean < 0.02 / 255);
        }
        scene_picture_free(&expected);
    }
    scene_destroy(&s);
}

/* A face of label 3 towards the eye and the light is lit fully, whatever the distance of the codes.
 * Its colour is multiplied by ambient plus diffuse. The highlight is added. */
static void outlines_are_lit_fully(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = nested });
    colour_labels(&s, 1e3F);
    s.table[codes[1]].extinction = 0;
    trip_camera_params view = scene_view(&s, trip_v3(-1, 0, 0), 60, 20, 4);
    view.ortho_height = 3;
    const trip_settings settings = nearest(true);
    const double matt = TRIP_AMBIENT + TRIP_DIFFUSE;
    scene_picture truth = scene_integrate(&s, &view, &settings, &(scene_making){ 0 });
    scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
    while (scene_take_turn(&turn))
        for (int n = 0; n < 16; n++) {
            const float *c = turn.picture.rgba + 4 * n;
            assert_close(c[0], TRIP_SPECULAR, 1e-3);
            assert_close(c[1], 0.5 * matt + TRIP_SPECULAR, 1e-3);
            assert_close(c[2], 1, 1e-3);
            assert_close(truth.rgba[4 * n + 1], 0.5 * matt + TRIP_SPECULAR, 1e-3);
        }
    scene_picture_free(&truth);
    scene_destroy(&s);
}

static void all_instruction_sets_equal_the_integral(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = balls });
    colour_labels(&s, 0.3F);
    trip_settings settings = nearest(true);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        for (int depth = 0; depth < 2; depth++) {
            settings.depth = depth;
            for (int n = 0; n < VIEWS; n++) {
                const trip_camera_params view = view_of(&s, n);
                trip_settings of_integral = settings;
                of_integral.depth = false;
                scene_picture truth =
                    scene_integrate(&s, &view, &of_integral, &(scene_making){ 0 });
                for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
                    if (strcmp(r->name, "cpu") != 0)
                        continue;
                    scene_picture p = scene_draw(&s, r, &view, &settings);
                    assert_true(mean_difference(&p, &truth) < 0.1 / 255);
                    scene_picture_free(&p);
                }
                scene_picture_free(&truth);
            }
        }
    }
    unsetenv("TRIPTYCH_ISA");
    scene_destroy(&s);
}

static void other_samples_per_sheet_are_refused(void **state)
{
    (void)state;
    trip_settings settings = nearest(false);
    assert_int_equal(trip_settings_check(&settings), 0);
    settings.samples_per_sheet = 3;
    assert_int_equal(trip_settings_check(&settings), TRIP_USAGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_box_within_a_box_ends_half_way_between_voxels),
        cmocka_unit_test(opaque_labels_show_no_colour_of_another_value),
        cmocka_unit_test(every_renderer_equals_the_integral),
        cmocka_unit_test(uneven_grids_equal_the_integral),
        cmocka_unit_test(holes_and_effects_agree_with_the_reference),
        cmocka_unit_test(outlines_are_lit_fully),
        cmocka_unit_test(all_instruction_sets_equal_the_integral),
        cmocka_unit_test(other_samples_per_sheet_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
