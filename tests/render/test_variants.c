/* Forms of splatting for comparison with the papers: footprints of a fixed size, weights of
 * vertices, image-aligned sheets, and colours divided by their opacity. Compares them with closed
 * forms, and gl with the reference. */
#include "cpu_scenes.h"
#include "normalise.h"
#include "splat.h"
#include "test.h"
#include "weight.h"

#define PI 3.14159265358979323846
enum { RED = 10, BLUE = 20, SIZE = 64 };

static trip_settings plain(void)
{
    trip_settings s = trip_settings_default();
    s.shading = false;
    s.background[3] = 0;
    return s;
}

/* Up to two voxels, red and blue. */
typedef struct pair {
    int red[3], blue[3];
} pair;

static bool pair_voxels(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const pair *p = user;
    const int at[3] = { i, j, k };
    (void)gradient;
    *code = memcmp(at, p->red, sizeof at) ? BLUE : RED;
    return !memcmp(at, p->red, sizeof at) || !memcmp(at, p->blue, sizeof at);
}

static void make_pair(scene *s, const pair *p, double extinction)
{
    scene_create(s, &(scene_params){ .dims = { 24, 24, 24 },
                                     .voxel = pair_voxels,
                                     .user = (void *)(uintptr_t)p });
    s->table[RED] = (trip_tf_entry){ 1, 0, 0, (float)extinction };
    s->table[BLUE] = (trip_tf_entry){ 0, 0, 1, (float)extinction };
}

static trip_camera camera_of(const scene *s, const trip_camera_params *view)
{
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, view, &s->data->index_to_world), 0);
    return c;
}

static const scene_renderer *next_with(const scene_renderer *r, const char *first,
                                       const char *second)
{
    while (r->name && strcmp(r->name, first) != 0 && strcmp(r->name, second) != 0)
        r++;
    return r;
}

static void a_sprite_is_as_large_as_the_sphere_in_the_middle(void **state)
{
    (void)state;
    const pair p = { { 3, 3, 3 }, { 20, 20, 20 } };
    scene s;
    make_pair(&s, &p, 1);
    trip_settings settings = plain();
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.4, -0.2), 50, 30, SIZE);
    trip_camera c = camera_of(&s, &view);
    const trip_vec3 middle = { 11.5, 11.5, 11.5 };
    double focal = 0.5 * SIZE / tan(15 * PI / 180);
    assert_close(trip_splat_sprite_px(&c, &settings, middle), 2 * 2 * focal / 50, 1e-9);
    assert_true(
        trip_splat_sprite_px(&c, &settings, trip_add(view.eye, trip_sub(view.eye, middle))) == 0);
    view.ortho_height = 30;
    c = camera_of(&s, &view);
    assert_close(trip_splat_sprite_px(&c, &settings, middle), 2 * 2 * SIZE / 30.0, 1e-9);
    scene_destroy(&s);
}

/* W b |v'c - E| / |vc - E| in world space, for a point away from the view's target. Voxels are
 * cubes, or cells that are longer in one direction. All rays here are perpendicular to the long
 * direction. */
static void off_the_axis_a_sprite_has_the_papers_size(void **state)
{
    (void)state;
    trip_settings settings = plain();
    for (int i = 0; i < 12; i++) {
        const double longer = i % 2 ? 3 : 1, degrees = 6 * i;
        trip_affine map = trip_affine_identity();
        map.m[2][2] = longer;
        const trip_vec3 eye = { 2, 3, 4 * longer }, ahead = trip_v3(0.6, 0.8, 0);
        trip_camera_params view = { .eye = eye,
                                    .look = trip_add(eye, ahead),
                                    .up = { 0, 0, 1 },
                                    .fov_degrees = 40,
                                    .width = 90,
                                    .height = 60 };
        trip_camera c;
        assert_int_equal(trip_camera_make(&c, &view, &map), 0);
        double angle = degrees * PI / 180, plane = 1 / tan(20 * PI / 180); /* 2 units high */
        trip_vec3 aside = trip_v3(-0.8, 0.6, 0);
        trip_vec3 from_eye =
            trip_scale(trip_add(trip_scale(ahead, cos(angle)), trip_scale(aside, sin(angle))), 35);
        double projected = plane / cos(angle), b = 2 * sqrt(longer);
        trip_vec3 middle = trip_add(eye, from_eye);
        middle.z /= longer;
        assert_close(trip_splat_sprite_px(&c, &settings, middle), 60 * b * projected / 35, 1e-9);
    }
}

/* Near and far voxels are equally large. The depth at their centre equals the depth of exact
 * footprints. */
static void every_sprite_has_the_papers_size(void **state)
{
    (void)state;
    const double width = 12, k2 = TRIP_CUTOFF * TRIP_CUTOFF, edge = exp(-k2 / 2);
    const double sigma2 = 4 / k2, sd2 = width * width / (4 * k2), wide2 = sd2 + 0.16;
    const double deepest = 2.5 / (2 * PI * sigma2) * (sd2 / wide2) / (1 - edge * (1 + k2 / 2));
    const pair p = { { 2, 3, 9 }, { 21, 20, 14 } };
    scene s;
    make_pair(&s, &p, 2.5);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.1, -0.1), 40, 60, SIZE);
    trip_camera c = camera_of(&s, &view);
    trip_settings settings = plain();
    settings.footprint = TRIP_FOOTPRINT_FIXED;
    settings.sprite_px = width;
    const scene_renderer *r = scene_renderers();
    for (; (r = next_with(r, "reference", "gl"))->name; r++) {
        scene_picture drawn = scene_draw(&s, r, &view, &settings);
        for (int n = 0; n < 2; n++) {
            const int *at = n ? p.blue : p.red;
            trip_vec3 v = trip_sub(trip_v3(at[0], at[1], at[2]), c.eye);
            double z = trip_dot(c.forward, v), x0 = trip_dot(c.to_x, v) / z;
            double y0 = trip_dot(c.to_y, v) / z;
            for (int i = 0; i < SIZE * SIZE; i++) {
                double dx = i % SIZE + 0.5 - x0, dy = i / SIZE + 0.5 - y0;
                double m = (dx * dx + dy * dy) / wide2;
                double depth = m < k2 ? deepest * (exp(-m / 2) - edge) : 0;
                assert_close(drawn.rgba[4 * i + 2 * n], -expm1(-depth), 1e-4);
            }
        }
        scene_picture_free(&drawn);
    }
    scene_destroy(&s);
}

static void in_parallel_views_of_cubes_nothing_changes(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 32, NULL);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.8, 0.6), 60, 30, 40);
    view.ortho_height = 40;
    trip_camera c = camera_of(&s, &view);
    trip_settings settings = plain();
    scene_picture exact = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
    settings.footprint = TRIP_FOOTPRINT_FIXED;
    settings.sprite_px = trip_splat_sprite_px(&c, &settings, trip_v3(9, 9, 9));
    scene_picture fixed = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
    assert_true(scene_difference(&fixed, &exact) < 1e-5);
    scene_picture_free(&exact);
    scene_picture_free(&fixed);
    scene_destroy(&s);
}

/* Sprites and triangles, from afar, near and inside, of cubes and of sheared cells. */
static void gl_draws_the_sprites_of_the_reference(void **state)
{
    (void)state;
    const scene_renderer *gl = next_with(scene_renderers(), "gl", "gl");
    const trip_affine sheared = cpu_scenes_sheared();
    if (!gl->name)
        skip(); /* scene_has_gl() checked why */
    for (int i = 0; i < 6; i++) {
        scene s;
        cpu_scenes_blobs(&s, 32, i % 2 ? &sheared : NULL);
        trip_camera_params view =
            scene_view(&s, trip_v3(i - 2.5, 1.2, 0.7 * i - 2), i == 4 ? 9 : 75 - 8 * i, 50, 48);
        view.ortho_height = i == 3 ? 40 : 0;
        trip_settings settings = plain();
        settings.shading = i % 3;
        settings.depth = i == 5;
        settings.triangles = i % 4 == 1;
        settings.footprint = TRIP_FOOTPRINT_FIXED;
        settings.sprite_px = 1.5 + 3 * i;
        scene_picture expected = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
        scene_picture drawn = scene_draw(&s, gl, &view, &settings);
        assert_true(scene_difference(&drawn, &expected) <= gl->tolerance);
        for (unsigned n = 0; n < s.data->list_count; n++)
            scene_compare_counts(&expected.lists[n], &drawn.lists[n], "gl");
        scene_picture_free(&expected);
        scene_picture_free(&drawn);
        scene_destroy(&s);
    }
}

/* The eye will be at the first voxel or a little behind it. */
static const pair about_the_eye = { { 11, 13, 9 }, { 20, 17, 14 } };

static trip_settings sprites(double width_px)
{
    trip_settings settings = plain();
    settings.footprint = TRIP_FOOTPRINT_FIXED;
    settings.sprite_px = width_px;
    return settings;
}

/* A voxel at the eye has no depth and no position in the picture. */
static void a_sprite_at_the_eye_is_not_drawn(void **state)
{
    (void)state;
    scene s;
    make_pair(&s, &about_the_eye, 5);
    const trip_settings settings = sprites(20);
    const scene_renderer *r = scene_renderers();
    for (; (r = next_with(r, "reference", "gl"))->name; r++) {
        for (int i = 0; i < 12; i++) {
            trip_camera_params view = scene_view(&s, trip_v3(1, 0, 0), 9, 100, SIZE);
            view.eye = trip_v3(11, 13, 9);
            view.look = trip_v3(20.1 + 0.17 * i, 17.3, 14.7 - 0.31 * i);
            scene_picture drawn = scene_draw(&s, r, &view, &settings);
            double max[2] = { 0 };
            for (int k = 0; k < SIZE * SIZE; k++)
                for (int c = 0; c < 2; c++)
                    max[c] = fmax(max[c], (double)drawn.rgba[4 * k + 2 * c]);
            assert_true(max[0] == 0 && max[1] > 0.1);
            scene_picture_free(&drawn);
        }
    }
    scene_destroy(&s);
}

/* The eye is a little behind the voxel, which lies on the ray through (30, 40). The sprite is
 * drawn there. */
static void a_sprite_just_before_the_eye_is_drawn_at_its_position(void **state)
{
    (void)state;
    scene s;
    make_pair(&s, &about_the_eye, 5);
    const trip_settings settings = sprites(9);
    const scene_renderer *r = scene_renderers();
    for (; (r = next_with(r, "reference", "gl"))->name; r++) {
        trip_camera_params view = scene_view(&s, trip_v3(1, 0.6, -0.3), 9, 100, SIZE);
        trip_camera c = camera_of(&s, &view);
        trip_vec3 way = trip_sub(view.look, view.eye);
        view.eye = trip_sub(trip_v3(11, 13, 9), trip_scale(trip_camera_ray(&c, 30, 40), 1e-5));
        view.look = trip_add(view.eye, way);
        scene_picture drawn = scene_draw(&s, r, &view, &settings);
        double sum = 0, x = 0, y = 0;
        for (int k = 0; k < SIZE * SIZE; k++) {
            double red = (double)drawn.rgba[4 * k];
            sum += red;
            x += red * (k % SIZE + 0.5);
            y += red * (k / SIZE + 0.5);
        }
        assert_true(sum > 1);
        assert_close(x / sum, 30, 0.01);
        assert_close(y / sum, 40, 0.01);
        scene_picture_free(&drawn);
    }
    scene_destroy(&s);
}

/* Tests whether a voxel of this density is opaque at (x, y). */
static bool covers(const trip_camera *c, const trip_settings *settings, const int at[3], double x,
                   double y)
{
    const trip_splat_frame f = trip_splat_frame_make(c, settings);
    trip_splat s;
    assert_true(trip_splat_project(&f, trip_v3(at[0], at[1], at[2]), &s));
    return trip_splat_radius2(&f, &s, x, y) < 9;
}

/* Returns the weight of the pixel at (x, y) in list `axis`, interpolated from the corners of the
 * bounds of the voxel's footprint. */
static double weight_by_corners(const trip_camera *c, const trip_settings *settings, int axis,
                                const int at[3], double x, double y)
{
    const trip_splat_frame f = trip_splat_frame_make(c, settings);
    trip_splat s;
    assert_true(trip_splat_project(&f, trip_v3(at[0], at[1], at[2]), &s));
    const double left = s.x0, right = s.x1, top = s.y0, bottom = s.y1;
    double w[2][2];
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) {
            trip_vec3 r = trip_camera_ray(c, j ? right : left, i ? bottom : top);
            double size = fmax(fabs(r.x), fmax(fabs(r.y), fabs(r.z)));
            w[i][j] = (fabs(trip_component(r, axis)) / size - settings->h) / (1 - settings->h);
        }
    double u = (x - left) / (right - left), v = (y - top) / (bottom - top);
    double low = w[0][0] * (1 - u - v) + w[0][1] * u + w[1][0] * v;
    double high = w[1][1] * (u + v - 1) + w[0][1] * (1 - v) + w[1][0] * (1 - u);
    return fmax(0, u + v <= 1 ? low : high);
}

/* The red voxel comes first along X, the blue one along Y. The last voxel of each list gives the
 * weight. */
static void weights_are_interpolated_between_the_corners_of_the_last_splat(void **state)
{
    (void)state;
    const pair p = { { 10, 11, 11 }, { 11, 10, 11 } };
    scene s;
    make_pair(&s, &p, 1e4);
    trip_camera_params view = scene_view(&s, trip_v3(-1, -1.03, 0.05), 25, 12, SIZE);
    trip_camera c = camera_of(&s, &view);
    trip_settings settings = plain();
    settings.vertex_weights = true;
    settings.h = 0.4;
    scene_picture drawn = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
    settings.vertex_weights = false;
    scene_picture defaults = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
    int mixed = 0;
    double apart = 0;
    for (int i = 0; i < SIZE * SIZE; i++) {
        const float *pixel = &defaults.rgba[4 * i];
        double x = i % SIZE + 0.5, y = i / SIZE + 0.5;
        trip_vec3 ray = trip_camera_ray(&c, x, y);
        if (!covers(&c, &settings, p.red, x, y) || !covers(&c, &settings, p.blue, x, y))
            continue;
        double wx = weight_by_corners(&c, &settings, 0, p.blue, x, y);
        double wy = weight_by_corners(&c, &settings, 1, p.red, x, y);
        double wz = fmax(0, (fabs(ray.z) / fmax(fabs(ray.x), fabs(ray.y)) - 0.4) / 0.6);
        assert_true(wz == 0);
        assert_close(drawn.rgba[4 * i], wx * wx / (wx * wx + wy * wy), 2e-3);
        assert_close(drawn.rgba[4 * i + 2], wy * wy / (wx * wx + wy * wy), 2e-3);
        apart = fmax(apart, fabs((double)drawn.rgba[4 * i] - (double)pixel[0]));
        mixed++;
    }
    assert_true(mixed > 100 && apart > 0.005);
    scene_picture_free(&drawn);
    scene_picture_free(&defaults);
    scene_destroy(&s);
}

/* In dense fog, a layer with weights from corners far beside a pixel must not leave the pixel
 * empty. */
static void weights_of_splats_about_the_eye_leave_no_holes(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 24, 24, 24 } });
    s.table[65535] = (trip_tf_entry){ 1, 1, 1, 5 };
    trip_settings settings = plain();
    settings.vertex_weights = true;
    for (int i = 0; i < 6; i++) {
        trip_camera_params view = scene_view(&s, trip_v3(1, 0.3 * i - 0.8, 0.4), 0.3 + i, 100, 40);
        settings.traversal = i % 2 ? TRIP_TRAVERSAL_ASCENDING : TRIP_TRAVERSAL_OUTWARD;
        scene_picture drawn = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
        for (int k = 0; k < 40 * 40; k++)
            assert_close(drawn.rgba[4 * k + 3], 1, 1e-3);
        scene_picture_free(&drawn);
    }
    scene_destroy(&s);
}

static trip_settings by_image(void)
{
    trip_settings s = plain();
    s.method = TRIP_METHOD_IMAGE;
    return s;
}

/* The parts of a splat in front of the eye add up to the splat. */
static void the_sheets_of_one_splat_add_up_to_it(void **state)
{
    (void)state;
    const pair p = { { 11, 12, 11 }, { 23, 23, 0 } };
    for (int i = 0; i < 4; i++) {
        scene s;
        make_pair(&s, &p, 1.5);
        s.table[BLUE].extinction = 0;
        trip_camera_params view =
            scene_view(&s, trip_v3(1, -0.7, 0.6), i % 2 ? 0.7 : 25, i % 2 ? 110 : 12, SIZE);
        view.ortho_height = i / 2 ? 6 : 0;
        trip_settings settings = plain();
        scene_picture defaults = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
        settings = by_image();
        settings.depth = true;
        scene_picture drawn = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
        assert_true(scene_pixel(&defaults, SIZE / 2, SIZE / 2)[3] > 0.1F);
        assert_true(scene_difference(&defaults, &drawn) < 1e-6);
        scene_picture_free(&defaults);
        scene_picture_free(&drawn);
        scene_destroy(&s);
    }
}

/* Planes have the depths n d. Integrates the share of a Gaussian between two planes by Simpson's
 * rule. */
static double share_between(double from, double to, double middle, double sigma)
{
    const double reach = TRIP_CUTOFF * sigma;
    enum { STEPS = 2000 };
    from = fmax(from, middle - reach);
    to = fmin(to, middle + reach);
    double sum = 0, all = erf(TRIP_CUTOFF / sqrt(2));
    for (int i = 0; i <= STEPS && to > from; i++) {
        double t = (from + (to - from) * i / STEPS - middle) / sigma;
        sum += exp(-t * t / 2) * (i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2);
    }
    return to > from ? sum * (to - from) / (3 * STEPS) / (sqrt(2 * PI) * sigma * all) : 0;
}

/* Two splats overlap along the ray through both. They are composited sheet by sheet and mixed
 * within each sheet. */
static void splats_are_cut_by_planes_of_equal_depth(void **state)
{
    (void)state;
    const double k2 = TRIP_CUTOFF * TRIP_CUTOFF, edge = exp(-k2 / 2), sigma = 2 / TRIP_CUTOFF;
    const pair p = { { 10, 11, 11 }, { 12, 11, 11 } };
    scene s;
    make_pair(&s, &p, 3);
    for (int i = 0; i < 4; i++) {
        trip_camera_params view = { .eye = { -7.3 + 0.37 * i, 11, 11 },
                                    .look = { 11, 11, 11 },
                                    .up = { 0, 0, 1 },
                                    .fov_degrees = 20,
                                    .ortho_height = i % 2 ? 10 : 0,
                                    .width = 61,
                                    .height = 61 };
        trip_settings settings = by_image();
        scene_picture drawn = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
        double colour[2] = { 0, 0 }, through = 1;
        double px = (i % 2 ? 10.0 : 2 * (10 - view.eye.x) * tan(10 * PI / 180)) / 61;
        double near2 = sigma * sigma / (px * px);
        px = (i % 2 ? 10.0 : 2 * (12 - view.eye.x) * tan(10 * PI / 180)) / 61;
        const double s2[2] = { near2, sigma * sigma / (px * px) };
        for (int n = 0; n < 40; n++) {
            double parts[2];
            for (int c = 0; c < 2; c++)
                parts[c] = 3 / (2 * PI * sigma * sigma) * (1 - edge) / (1 - edge * (1 + k2 / 2)) *
                           (s2[c] / (s2[c] + 0.16)) *
                           share_between(n, n + 1, 10 + 2 * c - view.eye.x, sigma);
            double depth = parts[0] + parts[1], alpha = -expm1(-depth);
            for (int c = 0; c < 2 && depth > 0; c++)
                colour[c] += through * alpha * parts[c] / depth;
            through *= 1 - alpha;
        }
        assert_close(scene_pixel(&drawn, 30, 30)[0], colour[0], 1e-4);
        assert_close(scene_pixel(&drawn, 30, 30)[2], colour[1], 1e-4);
        assert_true(colour[1] > 0.02);
        scene_picture_free(&drawn);
    }
    scene_destroy(&s);
}

/* Any list may be read. A turn by a hundredth of a degree across the change of the axis changes
 * almost nothing. With one list alone, the picture jumps. */
static void no_list_is_visible_in_image_aligned_sheets(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 32, NULL);
    double jumps[2];
    for (int image = 0; image < 2; image++) {
        scene_picture sides[2];
        trip_settings settings = image ? by_image() : plain();
        settings.method = image ? TRIP_METHOD_IMAGE : TRIP_METHOD_AXIS;
        for (int i = 0; i < 2; i++) {
            double angle = (45 + (i ? 0.005 : -0.005)) * PI / 180;
            trip_camera_params view =
                scene_view(&s, trip_v3(cos(angle), sin(angle), 0.2), 60, 30, 40);
            sides[i] = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
        }
        jumps[image] = scene_difference(&sides[0], &sides[1]);
        scene_picture_free(&sides[0]);
        scene_picture_free(&sides[1]);
    }
    assert_true(jumps[0] > 0.05);
    assert_true(jumps[1] < 0.005);
    scene_destroy(&s);
}

static void forms_require_splats_and_exclude_each_other(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++) {
        trip_settings settings = plain();
        settings.footprint = i == 0 ? TRIP_FOOTPRINT_FIXED : TRIP_FOOTPRINT_EXACT;
        settings.sprite_px = 3;
        settings.vertex_weights = i == 1;
        settings.method = i == 2 ? TRIP_METHOD_IMAGE : TRIP_METHOD_MERGE;
        settings.traversal = TRIP_TRAVERSAL_OUTWARD;
        assert_int_equal(trip_settings_check(&settings), 0);
        settings.classify = TRIP_CLASSIFY_POST;
        trip_report_redirect(test_catch, NULL);
        assert_int_equal(trip_settings_check(&settings), TRIP_USAGE);
        settings.classify = TRIP_CLASSIFY_PRE;
        settings.lod_px = 2;
        settings.compositing = TRIP_COMPOSITING_SHEET;
        assert_int_equal(trip_settings_check(&settings), TRIP_USAGE);
        trip_report_redirect(NULL, NULL);
    }
}

static void colours_are_divided_by_their_opacity(void **state)
{
    (void)state;
    float rgba[12] = { 0.1F, 0.05F, 0, 0.2F, 0, 0, 0, 0, 3e-5F, 0, 0, 5e-5F };
    trip_normalise(rgba, 3, (double[4]){ 0.5, 1, 0, 0.5 });
    const double expected[12] = { 0.5, 0.25, 0, 1, 0.25, 0.5, 0, 0.5, 0.25, 0.5, 0, 0.5 };
    for (int i = 0; i < 12; i++)
        assert_close(rgba[i], expected[i], 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sprite_is_as_large_as_the_sphere_in_the_middle),
        cmocka_unit_test(off_the_axis_a_sprite_has_the_papers_size),
        cmocka_unit_test(every_sprite_has_the_papers_size),
        cmocka_unit_test(in_parallel_views_of_cubes_nothing_changes),
        cmocka_unit_test(gl_draws_the_sprites_of_the_reference),
        cmocka_unit_test(a_sprite_at_the_eye_is_not_drawn),
        cmocka_unit_test(a_sprite_just_before_the_eye_is_drawn_at_its_position),
        cmocka_unit_test(weights_are_interpolated_between_the_corners_of_the_last_splat),
        cmocka_unit_test(weights_of_splats_about_the_eye_leave_no_holes),
        cmocka_unit_test(the_sheets_of_one_splat_add_up_to_it),
        cmocka_unit_test(splats_are_cut_by_planes_of_equal_depth),
        cmocka_unit_test(no_list_is_visible_in_image_aligned_sheets),
        cmocka_unit_test(forms_require_splats_and_exclude_each_other),
        cmocka_unit_test(colours_are_divided_by_their_opacity),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
