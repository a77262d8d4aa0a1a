/* Fog of very many splats with very little opacity each, against the closed form. The test bounds
 * the loss by rounding in each form of layer. */
#include "hard.h"
#include "test.h"

enum { SIZE = 4 };

/* A body of fog seen along Z. The kernel is wide, so that many splats meet a ray. */
typedef struct fog {
    scene scene;
    trip_camera_params view;
    double radius;
    int deep;
} fog;

static void make_fog(fog *f, int side, int deep, double radius)
{
    scene_create(&f->scene, &(scene_params){ .dims = { side, side, deep } });
    f->view = scene_view(&f->scene, trip_v3(0, 0, 1), 2 * deep, 30, SIZE);
    f->view.ortho_height = 2;
    f->radius = radius;
    f->deep = deep;
}

/* Returns the visible opacity of fog with a given optical depth. */
static double opacity_of(fog *f, const scene_renderer *r, double depth,
                         trip_compositing compositing, trip_target target)
{
    trip_settings settings = hard_settings();
    settings.kernel_radius = f->radius;
    settings.compositing = compositing;
    settings.target = target;
    f->scene.table[65535] = (trip_tf_entry){ 1, 0.5F, 0.25F, (float)(depth / f->deep) };
    scene_picture p = scene_draw(&f->scene, r, &f->view, &settings);
    double alpha = (double)scene_pixel(&p, 2, 2)[3];
    assert_true(fabs(2 * (double)scene_pixel(&p, 2, 2)[1] - alpha) < 0.01);
    scene_picture_free(&p);
    return alpha;
}

static void expect_off(double alpha, double depth, double max, const char *label)
{
    double off = fabs(alpha + expm1(-depth));
    if (!(off <= max))
        fail_msg("%s, optical depth %g: off by %.3f of 255, at most %.3f", label, depth, 255 * off,
                 255 * max);
}

/* A ray meets 720,000 splats, 12.8 for each opacity of 1e-4. Each splat is rounded once, by at
 * most 2^-25. A pixel stops at TRIP_EARLY_TERMINATION_PRE. */
static void a_million_splats_lose_at_most_their_rounding(void **state)
{
    (void)state;
    const double n = 3.14159 * 30 * 30 * 256;
    fog f;
    make_fog(&f, 64, 256, 30);
    for (int i = 0; i < 2; i++) {
        double depth = i ? 12.8 : 0.03;
        double alpha =
            opacity_of(&f, &cpu_scenes_cpu, depth, TRIP_COMPOSITING_SPLAT, TRIP_TARGET_RGBA32F);
        expect_off(alpha, depth, n * 0x1p-25, "splats");
        alpha = opacity_of(&f, &cpu_scenes_cpu, depth, TRIP_COMPOSITING_SHEET, TRIP_TARGET_RGBA32F);
        expect_off(alpha, depth, 1.0 / 8192 + 256 * 0x1p-24, "sheets");
    }
    scene_destroy(&f.scene);
}

/* Compositing by sheets rounds each sheet once, by half a step. A driver that truncates rounds by a
 * whole step. */
static void by_sheets_layers_are_rounded_once_a_sheet(void **state)
{
    (void)state;
    fog f;
    make_fog(&f, 28, 40, 12);
    for (const scene_renderer *r = scene_renderers() + 1; r->name; r++)
        for (int i = 0; i < 3; i++) {
            const double depths[] = { 1e-3, 0.3, 3 };
            double alpha =
                opacity_of(&f, r, depths[i], TRIP_COMPOSITING_SHEET, TRIP_TARGET_RGBA16F);
            expect_off(alpha, depths[i], 40 * 0x1p-11 + 1.0 / 8192, r->name);
            alpha = opacity_of(&f, r, depths[i], TRIP_COMPOSITING_SHEET, TRIP_TARGET_RGBA32F);
            expect_off(alpha, depths[i], 1.0 / 8192 + 40 * 0x1p-24, r->name);
        }
    scene_destroy(&f.scene);
}

/* Opacities of 0, denormal floats, and values that count as opaque. */
static void opacities_may_be_zero_denormal_or_one(void **state)
{
    (void)state;
    const int64_t dims[3] = { 9, 9, 9 };
    scene s;
    hard_lumps(&s, dims, NULL);
    for (int i = 0; i < 4; i++) {
        const float extinctions[] = { 0, 1e-42F, 9.2F, 1e30F };
        for (int code = 0; code < 65536; code++)
            s.table[code].extinction = extinctions[i];
        hard_view v = { .name = "opacity", .settings = hard_settings(), .forms = HARD_ALL };
        v.camera = scene_view(&s, trip_v3(0.3, 1, 0.2), 25, 30, 12);
        v.shows = i > 1;
        v.gl = HARD_ALL;
        hard_check(&s, &v);
    }
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_million_splats_lose_at_most_their_rounding),
        cmocka_unit_test(by_sheets_layers_are_rounded_once_a_sheet),
        cmocka_unit_test(opacities_may_be_zero_denormal_or_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
