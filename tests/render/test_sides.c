/* The order of splats about the eye. A ray meets the sheets of a list in its direction. It first
 * meets splats with centres behind the eye that reach before the eye. */
#include "cpu_scenes.h"
#include "splat.h"
#include "test.h"
#include "weight.h"

#include <stdlib.h>

enum { EDGE = 16, WIDTH = 48, HEIGHT = 36, SPLATS_MAX = 6 };

static trip_settings unlit(trip_compositing compositing)
{
    trip_settings s = trip_settings_default();
    s.shading = false;
    s.background[3] = 0;
    s.compositing = compositing;
    return s;
}

/* Returns a view wide enough for rays in both directions along every axis, each direction with
 * weight. */
static trip_camera_params view_from(trip_vec3 eye, trip_vec3 towards)
{
    return (trip_camera_params){ .eye = eye,
                                 .look = trip_add(eye, towards),
                                 .up = { 0.1, 0.3, 1 },
                                 .fov_degrees = 130,
                                 .width = WIDTH,
                                 .height = HEIGHT };
}

static trip_camera camera_of(const scene *s, const trip_camera_params *view)
{
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, view, &s->data->index_to_world), 0);
    return c;
}

/* The difference must be within twice the renderer's tolerance. */
static void expect_same(const scene_renderer *r, const scene_picture *p, const scene_picture *q,
                        const char *label)
{
    const double apart = scene_difference(p, q);
    const double max = strcmp(r->name, "reference") ? 2 * r->tolerance : 1e-4;
    if (!(apart <= max))
        fail_msg("%s, %s: %.4f of 255 apart, at most %.4f", r->name, label, 255 * apart, 255 * max);
}

/* Dense fog of one extinction. Its sheets have many colours. */
static bool colourful(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 8192 * (1 + scene_hash(i / 2, j / 2, k) % 7);
    return true;
}

static void make_colours(scene *s)
{
    for (unsigned n = 1; n < 8; n++)
        s->table[8192 * n] = (trip_tf_entry){
            .r = (float)(n & 1), .g = (float)(n >> 1 & 1), .b = (float)(n >> 2), .extinction = 0.7F
        };
}

static void make_fog(scene *s, const trip_coordinates *coordinates)
{
    scene_create(s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                     .coordinates = coordinates,
                                     .tile_voxels = 16,
                                     .slab_sheets = 4,
                                     .voxel = colourful });
    make_colours(s);
}

/* Compares views from the two sides of sheet `sheet` of an axis. They are so close that no pixel
 * may differ. */
static void compare_sides(const scene *s, const scene_renderer *r, int axis, double sheet,
                          const trip_settings *settings)
{
    const double near = 1e-6;
    const double step[3] = { axis == 0 ? near : 0, axis == 1 ? near : 0, axis == 2 ? near : 0 };
    double at[3] = { 7.3, 8.6, 7.8 };
    at[axis] = sheet;
    const trip_vec3 eye = { at[0], at[1], at[2] }, side = { step[0], step[1], step[2] };
    const trip_vec3 towards = { axis == 0 ? 0.1 : 1, axis == 1 ? -0.2 : 0.8, axis == 2 ? 0.1 : -1 };
    char label[64];
    snprintf(label, sizeof label, "sheet %g of axis %d", sheet, axis);
    const trip_camera_params above = view_from(trip_add(eye, side), towards);
    const trip_camera_params below = view_from(trip_sub(eye, side), towards);
    scene_picture p = scene_draw(s, r, &above, settings);
    scene_picture q = scene_draw(s, r, &below, settings);
    expect_same(r, &p, &q, label);
    scene_picture_free(&q);
    q = scene_draw(s, scene_renderers(), &above, settings);
    if (!trip_coordinates_uneven(&s->data->coordinates)) /* cpu sums near splats less accurately */
        expect_same(r, &p, &q, "as the reference");
    scene_picture_free(&p);
    scene_picture_free(&q);
}

static void compare_all_sides(const scene *s, const trip_settings *settings, const double sheets[3])
{
    const bool fixed = settings->footprint == TRIP_FOOTPRINT_FIXED; /* not by cpu */
    for (const scene_renderer *r = scene_renderers(); r->name; r++)
        for (int axis = 0; axis < 3 && !(fixed && !strcmp(r->name, "cpu")); axis++)
            compare_sides(s, r, axis, sheets[axis], settings);
}

static void pictures_do_not_jump_as_the_eye_passes_a_sheet(void **state)
{
    (void)state;
    const double sheets[3] = { 8, 7, 8 };
    scene s;
    make_fog(&s, NULL);
    for (int i = 0; i < 8; i++) {
        trip_settings settings = unlit(i & 1 ? TRIP_COMPOSITING_SHEET : TRIP_COMPOSITING_SPLAT);
        settings.footprint = i & 2 ? TRIP_FOOTPRINT_EWA : TRIP_FOOTPRINT_EXACT;
        settings.method = i & 4 ? TRIP_METHOD_CLIP : TRIP_METHOD_MERGE;
        compare_all_sides(&s, &settings, sheets);
    }
    scene_destroy(&s);
}

/* Fixed footprints have the same width in pixels at any depth. Deeper splats therefore reach
 * farther across the eye's plane. */
static void pictures_do_not_jump_with_fixed_footprints(void **state)
{
    (void)state;
    const double sheets[3] = { 8, 7, 8 };
    scene s;
    make_fog(&s, NULL);
    for (int i = 0; i < 2; i++) {
        trip_settings settings = unlit(i ? TRIP_COMPOSITING_SHEET : TRIP_COMPOSITING_SPLAT);
        settings.footprint = TRIP_FOOTPRINT_FIXED;
        settings.sprite_px = 14;
        settings.h = 0.2;
        compare_all_sides(&s, &settings, sheets);
    }
    scene_destroy(&s);
}

/* In such grids, a splat is as wide as its voxel. */
static void pictures_do_not_jump_with_uneven_spacing(void **state)
{
    (void)state;
    double tables[3][EDGE], sheets[3];
    const double *along[3];
    const int64_t voxels[3] = { EDGE, EDGE, EDGE };
    for (int a = 0; a < 3; a++) {
        for (int i = 0; i < EDGE; i++)
            tables[a][i] = i + 0.4 * sin(0.9 * i + a) - 0.4 * sin(a);
        for (int i = 1; i < EDGE; i++)
            tables[a][i] *= (EDGE - 1) / tables[a][EDGE - 1];
        tables[a][EDGE - 1] = EDGE - 1;
        sheets[a] = tables[a][7];
        along[a] = tables[a];
    }
    const trip_coordinates coordinates = trip_coordinates_make(along, voxels);
    scene s;
    make_fog(&s, &coordinates);
    trip_settings settings = unlit(TRIP_COMPOSITING_SPLAT);
    compare_all_sides(&s, &settings, sheets);
    settings = unlit(TRIP_COMPOSITING_SHEET);
    settings.footprint = TRIP_FOOTPRINT_EWA;
    compare_all_sides(&s, &settings, sheets);
    scene_destroy(&s);
}

/* Voxels that share no coordinate, each with its own colour. */
typedef struct few {
    int count;
    int at[SPLATS_MAX][3];
} few;

static bool one_of_few(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const few *f = user;
    (void)gradient;
    for (int n = 0; n < f->count; n++)
        if (f->at[n][0] == i && f->at[n][1] == j && f->at[n][2] == k)
            return *code = 8192 * (1 + (unsigned)n), true;
    return false;
}

/* Returns voxels around the centre of the grid, within two voxels of it. */
static few random_few(int count)
{
    few f = { .count = count };
    int order[3][SPLATS_MAX];
    for (int a = 0; a < 3; a++)
        for (int n = 0; n < SPLATS_MAX; n++) {
            int other = (int)(test_random() * (n + 1));
            order[a][n] = n;
            order[a][n] = order[a][other];
            order[a][other] = n;
        }
    for (int n = 0; n < count; n++)
        for (int a = 0; a < 3; a++)
            f.at[n][a] = EDGE / 2 - SPLATS_MAX / 2 + order[a][n];
    return f;
}

/* Returns the n-th splat that a ray meets along an axis. */
static const int *met_as(const few *f, int axis, bool up, int n)
{
    for (int i = 0; i < f->count; i++) {
        int before = 0;
        for (int k = 0; k < f->count; k++)
            before += up ? f->at[k][axis] < f->at[i][axis] : f->at[k][axis] > f->at[i][axis];
        if (before == n)
            return f->at[i];
    }
    return NULL;
}

static double opacity_at(const trip_splat_frame *f, const trip_splat *s, double x, double y,
                         double extinction)
{
    const double m = trip_splat_radius2(f, s, x, y);
    if (!(m <= f->cutoff2))
        return 0;
    const double depth = extinction * (s->affine ? 1 : trip_splat_stretch(f, x, y)) * s->amplitude *
                         (exp(-m / 2) - f->edge) * trip_splat_front(f, s, x, y);
    return -expm1(-depth);
}

/* Composites all splats in the order in which the ray meets their sheets. */
static void composite(const scene *s, const few *all, const trip_splat_frame *f, int axis, double x,
                      double y, double layer[4])
{
    const bool up = trip_component(trip_camera_ray(&f->camera, x, y), axis) > 0;
    for (int n = 0; n < all->count; n++) {
        const int *at = met_as(all, axis, up, n);
        unsigned code = 0;
        double none[3];
        trip_splat splat;
        assert_true(one_of_few((void *)(uintptr_t)all, at[0], at[1], at[2], &code, none));
        if (!trip_splat_project(f, trip_v3(at[0], at[1], at[2]), &splat))
            continue;
        const trip_tf_entry *e = &s->table[code];
        const double share = (1 - layer[3]) * opacity_at(f, &splat, x, y, (double)e->extinction);
        const double rgba[4] = { (double)e->r, (double)e->g, (double)e->b, 1 };
        for (int c = 0; c < 4; c++)
            layer[c] += share * rgba[c];
    }
}

static void expect_pixel(const scene *s, const few *all, const trip_splat_frame *f,
                         const trip_settings *settings, const scene_renderer *r,
                         const scene_picture *p, int pixel)
{
    const double x = pixel % WIDTH + 0.5, y = pixel / WIDTH + 0.5;
    const trip_vec3 ray = trip_camera_ray(&f->camera, x, y);
    double merged[4] = { 0 }, weights = 0;
    for (int axis = 0; axis < 3; axis++) {
        const double w = trip_weight(settings, trip_weight_axis_of_view(&f->camera), ray, axis);
        double layer[4] = { 0 };
        composite(s, all, f, axis, x, y, layer);
        weights += w * w;
        for (int c = 0; c < 4; c++)
            merged[c] += w * w * layer[c];
    }
    const double max = strcmp(r->name, "reference") ? r->tolerance : 1e-6;
    for (int c = 0; c < 4; c++) {
        const double off = fabs((double)p->rgba[4 * pixel + c] - merged[c] / weights);
        if (!(off <= max))
            fail_msg("%s, %d splats, pixel %d: off by %.4f of 255", r->name, all->count, pixel,
                     255 * off);
    }
}

static void expect_order(const scene *s, const few *all, const trip_camera_params *view,
                         const trip_settings *settings)
{
    const trip_camera c = camera_of(s, view);
    const trip_splat_frame f = trip_splat_frame_make(&c, settings);
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        scene_picture p = scene_draw(s, r, view, settings);
        for (int pixel = 0; pixel < WIDTH * HEIGHT; pixel++)
            expect_pixel(s, all, &f, settings, r, &p, pixel);
        scene_picture_free(&p);
    }
}

static double between(double lo, double hi)
{
    return lo + (hi - lo) * test_random();
}

/* The test includes a single splat. Its sheet is in the passes of both directions. */
static void splats_about_the_eye_are_in_the_order_of_the_ray(void **state)
{
    (void)state;
    for (int i = 0; i < 24; i++) {
        few f = random_few(1 + i % SPLATS_MAX);
        scene s;
        scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                          .tile_voxels = 16,
                                          .slab_sheets = 4,
                                          .voxel = one_of_few,
                                          .user = &f });
        make_colours(&s);
        const int *at = f.at[0];
        const trip_vec3 eye = { at[0] + between(-0.7, 0.7), at[1] + between(-0.7, 0.7),
                                at[2] + between(-0.7, 0.7) };
        const trip_vec3 towards = { between(-1, 1), between(-1, 1), between(-1, 1) };
        const trip_camera_params view = view_from(eye, towards);
        trip_settings settings = unlit(i / 6 % 2 ? TRIP_COMPOSITING_SHEET : TRIP_COMPOSITING_SPLAT);
        settings.h = i % 3 ? between(0.1, 0.9) : 0;
        settings.footprint = i % 4 == 3 ? TRIP_FOOTPRINT_EWA : TRIP_FOOTPRINT_EXACT;
        settings.method = i % 5 == 4 ? TRIP_METHOD_AXIS : TRIP_METHOD_MERGE;
        expect_order(&s, &f, &view, &settings);
        scene_destroy(&s);
    }
}

/* The red splat lies 0.3 voxel below the eye and the blue one above it. Looking straight up, red
 * is before blue. Looking straight down, only red is visible, apart from the part of blue that
 * reaches below the eye. */
static void a_splat_just_behind_the_eye_covers_farther_ones(void **state)
{
    (void)state;
    few f = { .count = 2, .at = { { 8, 8, 8 }, { 8, 8, 10 } } };
    scene s;
    scene_create(&s,
                 &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = one_of_few, .user = &f });
    s.table[8192] = (trip_tf_entry){ 1, 0, 0, 4 };
    s.table[2 * 8192] = (trip_tf_entry){ 0, 0, 1, 1e6F };
    trip_camera_params view = { .eye = { 8, 8, 8.3 },
                                .look = { 8, 8, 20 },
                                .up = { 0, 1, 0 },
                                .fov_degrees = 20,
                                .width = 15,
                                .height = 15 };
    trip_settings settings = unlit(TRIP_COMPOSITING_SPLAT);
    settings.low_pass = TRIP_LOW_PASS_NONE;
    /* The share above the eye of the Gaussian on its axis. The Gaussian is cut off at k and
     * lowered to end at 0 there. */
    const double sigma = settings.kernel_radius / TRIP_CUTOFF, k = TRIP_CUTOFF;
    const double edge = exp(-0.5 * k * k), t = 0.3 / sigma;
    const double whole =
        (1 - edge) / (6.28318530717958648 * sigma * sigma * (1 - edge * (1 + 0.5 * k * k)));
    const double front = 0.5 * (1 - erf(t * sqrt(0.5)) / erf(k * sqrt(0.5)));
    const double red = -expm1(-4 * whole * front);
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        scene_picture p = scene_draw(&s, r, &view, &settings);
        const float *middle = scene_pixel(&p, 7, 7);
        const double max = strcmp(r->name, "reference") ? r->tolerance : 1e-6;
        assert_true(fabs((double)middle[0] - red) <= max);
        assert_true(fabs((double)middle[2] - (1 - red)) <= max);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_do_not_jump_as_the_eye_passes_a_sheet),
        cmocka_unit_test(pictures_do_not_jump_with_fixed_footprints),
        cmocka_unit_test(pictures_do_not_jump_with_uneven_spacing),
        cmocka_unit_test(splats_about_the_eye_are_in_the_order_of_the_ray),
        cmocka_unit_test(a_splat_just_behind_the_eye_covers_farther_ones),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
