/* Early termination (trip_settings.early_termination). Checks at which transmittance a pixel stops,
 * how far the picture is from one without termination, and that renderers and instruction sets
 * agree.
 */
#include "cpu/kernels/isa.h"
#include "cpu_scenes.h"
#include "test.h"

#include <stdlib.h>

enum { EDGE = 32, PIXELS = 72 };

/* Waves; every voxel is present. */
static bool waves(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const double at = sin(0.5 * i) + sin(0.4 * j + 1) + sin(0.6 * k + 2);
    (void)user;
    (void)gradient;
    *code = (unsigned)(65535 * (0.5 + at / 6.1));
    return true;
}

/* Half of the volume is empty, so that rays lose their light in many ways. */
static void create_waves(scene *s)
{
    scene_create(s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = waves });
    scene_colour(s, 30000, 42000, 0.9, 0.6, 0.2, 0.25);
    scene_colour(s, 42001, 65535, 0.3, 0.8, 1, 0.6);
}

static trip_settings with(trip_classify classify, trip_compositing compositing,
                          double early_termination)
{
    trip_settings s = trip_settings_default();
    s.classify = classify;
    s.compositing = compositing;
    s.early_termination = early_termination;
    s.shading = false;
    s.background[3] = 0;
    return s;
}

/* The gl renderer blends all splats. */
static bool takes(const scene_renderer *r, const trip_settings *s)
{
    return strcmp(r->name, "gl") != 0 || s->classify == TRIP_CLASSIFY_POST;
}

static const struct {
    trip_classify classify;
    trip_compositing compositing;
} forms[] = { { TRIP_CLASSIFY_PRE, TRIP_COMPOSITING_SPLAT },
              { TRIP_CLASSIFY_PRE, TRIP_COMPOSITING_SHEET },
              { TRIP_CLASSIFY_POST, TRIP_COMPOSITING_SPLAT } };
enum { FORMS = sizeof forms / sizeof *forms };

static const scene_renderer *renderers_of(int form)
{
    return forms[form].classify == TRIP_CLASSIFY_POST ? scene_renderers_post() : scene_renderers();
}

static const double thresholds[] = { TRIP_EARLY_TERMINATION_AUTO, 1.0 / 128, 1.0 / 32,
                                     TRIP_EARLY_TERMINATION_MAX };
enum { THRESHOLDS = sizeof thresholds / sizeof *thresholds };

/* Checks the error bound for one renderer and form. */
static void check_bound(const scene *s, const scene_renderer *r, int form)
{
    trip_camera_params view = scene_view(s, trip_v3(1, 0.8, 0.6), 60, 36, PIXELS);
    const trip_settings all = with(forms[form].classify, forms[form].compositing, 0);
    scene_picture wanted = scene_draw(s, r, &view, &all);
    for (int i = 0; i < THRESHOLDS; i++) {
        trip_settings settings = all;
        settings.early_termination = thresholds[i];
        if (!takes(r, &settings))
            continue;
        scene_picture p = scene_draw(s, r, &view, &settings);
        const double min = trip_settings_early_termination(&settings);
        const double off = scene_difference(&p, &wanted);
        assert_true(off <= min + 2e-6);
        assert_true(off > min / 8);
        scene_picture_free(&p);
    }
    scene_picture_free(&wanted);
}

static void no_component_is_off_by_more_than_the_early_termination(void **state)
{
    (void)state;
    scene s;
    create_waves(&s);
    for (int form = 0; form < FORMS; form++)
        for (const scene_renderer *r = renderers_of(form); r->name; r++)
            check_bound(&s, r, form);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        for (int form = 0; form < FORMS; form++)
            check_bound(&s, &cpu_scenes_cpu, form);
    }
    unsetenv("TRIPTYCH_ISA");
    scene_destroy(&s);
}

static double difference_at(const scene_picture *a, const scene_picture *b, int n)
{
    double max = 0;
    for (int c = 0; c < 4; c++)
        max = fmax(max, fabs((double)a->rgba[4 * n + c] - (double)b->rgba[4 * n + c]));
    return max;
}

/* A pixel very close to the threshold at some splat or segment may take one more. */
static void renderers_stop_at_the_same_samples(void **state)
{
    (void)state;
    scene s;
    create_waves(&s);
    trip_camera_params view = scene_view(&s, trip_v3(-0.4, 1, 0.7), 60, 36, PIXELS);
    for (int form = 0; form < FORMS; form++)
        for (int i = 0; i < THRESHOLDS; i++) {
            const trip_settings settings =
                with(forms[form].classify, forms[form].compositing, thresholds[i]);
            scene_picture wanted = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
            for (const scene_renderer *r = renderers_of(form); r->name; r++) {
                if (!takes(r, &settings))
                    continue;
                scene_picture p = scene_draw(&s, r, &view, &settings);
                int apart = 0;
                for (int n = 0; n < PIXELS * PIXELS; n++) {
                    const double off = difference_at(&p, &wanted, n);
                    apart += off > r->tolerance;
                    assert_true(off <= r->tolerance + trip_settings_early_termination(&settings));
                }
                assert_true(apart <= PIXELS * PIXELS / 200);
                scene_picture_free(&p);
            }
            scene_picture_free(&wanted);
        }
    scene_destroy(&s);
}

enum { FRONT = 10, BEHIND = 20 };

/* Two voxels, one behind the other along x. */
static bool two_voxels(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = i == 6 ? FRONT : BEHIND;
    return j == 4 && k == 4 && (i == 6 || i == 1);
}

static scene_picture draw_two(scene *s, const scene_renderer *r, trip_compositing compositing,
                              double early_termination, bool front, bool behind)
{
    trip_camera_params view = scene_view(s, trip_v3(1, 0, 0), 60, 6, 3);
    view.ortho_height = 1;
    const trip_settings settings = with(TRIP_CLASSIFY_PRE, compositing, early_termination);
    s->table[FRONT] = (trip_tf_entry){ 1, 0, 0, front ? 7 : 0 };
    s->table[BEHIND] = (trip_tf_entry){ 0, 1, 0, behind ? 4 : 0 };
    return scene_draw(s, r, &view, &settings);
}

/* A picture of one splat alone gives the transmittance behind the splat. */
static void splats_are_blended_until_early_termination_and_not_after(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 9, 9, 9 }, .voxel = two_voxels });
    for (int form = 0; form < 2; form++) {
        const trip_compositing by = forms[form].compositing;
        for (const scene_renderer *r = scene_renderers(); r->name; r++) {
            scene_picture front = draw_two(&s, r, by, 0, true, false);
            scene_picture behind = draw_two(&s, r, by, 0, false, true);
            const double through = 1 - (double)scene_pixel(&front, 1, 1)[3];
            const double green = (double)scene_pixel(&behind, 1, 1)[1];
            assert_true(through > 0.01 && through < TRIP_EARLY_TERMINATION_MAX / 1.01 &&
                        green > 0.5);
            for (int i = 0; i < 3; i++) {
                const double early_termination = through * (const double[]){ 0, 0.99, 1.01 }[i];
                if (i && !strcmp(r->name, "gl"))
                    continue;
                scene_picture both = draw_two(&s, r, by, early_termination, true, true);
                const float *p = scene_pixel(&both, 1, 1);
                assert_close(p[1], i == 2 ? 0 : through * green, 1e-5);
                assert_close(p[3], i == 2 ? 1 - through : 1 - through * (1 - green), 1e-5);
                scene_picture_free(&both);
            }
            scene_picture_free(&front);
            scene_picture_free(&behind);
        }
    }
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_component_is_off_by_more_than_the_early_termination),
        cmocka_unit_test(renderers_stop_at_the_same_samples),
        cmocka_unit_test(splats_are_blended_until_early_termination_and_not_after),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
