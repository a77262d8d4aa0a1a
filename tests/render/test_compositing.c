/* Splats composited sheet by sheet, in every renderer. Compares them with closed forms and the
 * reference, and checks their order. A volume that is mirrored, turned or moved with its camera
 * must give the same picture. */
#include "cpu_scenes.h"
#include "scenes.h"
#include "splat.h"
#include "test.h"

#include <string.h>

static trip_settings by(trip_compositing compositing)
{
    trip_settings s = trip_settings_default();
    s.compositing = compositing;
    s.shading = false;
    s.background[3] = 0;
    return s;
}

static trip_vec3 vector(const double v[3])
{
    return trip_v3(v[0], v[1], v[2]);
}

enum { FEW = 5, RED = 10, BLUE = 20 };

typedef struct voxel {
    int at[3]; /* along the list, then along the next two axes */
    unsigned code;
} voxel;

/* Three neighbours in one sheet and two in the sheet after the next. All of them overlap. */
static const voxel few[FEW] = { { { 3, 3, 3 }, RED },
                                { { 3, 4, 3 }, BLUE },
                                { { 3, 3, 4 }, BLUE },
                                { { 5, 4, 4 }, RED },
                                { { 5, 3, 3 }, BLUE } };

/* Places the voxels along the axis *user. */
static bool few_voxels(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const int at[3] = { i, j, k }, axis = *(int *)user;
    (void)gradient;
    for (int n = 0; n < FEW; n++)
        if (few[n].at[0] == at[axis] && few[n].at[1] == at[(axis + 1) % 3] &&
            few[n].at[2] == at[(axis + 2) % 3]) {
            *code = few[n].code;
            return true;
        }
    return false;
}

static double squared_distance(trip_vec3 p, trip_vec3 origin, trip_vec3 direction)
{
    trip_vec3 across = trip_cross(trip_sub(p, origin), direction);
    return trip_dot(across, across);
}

/* Computes red, blue and opacity from the sums of the voxels, sheet by sheet, from their distances
 * to the ray. The splats are so large that the low-pass filter has no visible effect. */
static void expected_of_few(const scene *s, int axis, bool descending, trip_vec3 o, trip_vec3 d,
                            double out[3])
{
    const double k2 = TRIP_CUTOFF * TRIP_CUTOFF, edge = exp(-k2 / 2);
    const double sigma2 = TRIP_KERNEL_RADIUS_VOXELS * TRIP_KERNEL_RADIUS_VOXELS / k2;
    const double amplitude = 1 / (2 * 3.14159265358979323846 * sigma2) / (1 - edge * (1 + k2 / 2));
    double through = 1;
    out[0] = out[1] = 0;
    for (int turn = 0; turn < 2; turn++) {
        int sheet = descending == (turn == 0) ? 5 : 3;
        double depth[2] = { 0, 0 };
        for (int n = 0; n < FEW; n++) {
            double at[3];
            for (int i = 0; i < 3; i++)
                at[(axis + i) % 3] = few[n].at[i];
            double m = squared_distance(vector(at), o, d) / sigma2;
            if (few[n].at[0] == sheet && m < k2)
                depth[few[n].code == BLUE] +=
                    (double)s->table[few[n].code].extinction * amplitude * (exp(-m / 2) - edge);
        }
        double sum = depth[0] + depth[1], alpha = -expm1(-sum);
        for (int i = 0; i < 2 && sum > 0; i++)
            out[i] += through * alpha * depth[i] / sum;
        through *= 1 - alpha;
    }
    out[2] = 1 - through;
}

static void splats_of_a_sheet_add_and_sheets_composite(void **state)
{
    (void)state;
    for (int i = 0; i < 12; i++) {
        int axis = i % 3;
        double d[3] = { 0.13, 0.1, -0.12 };
        d[axis] = i / 3 % 2 ? 1 : -1;
        scene s;
        scene_create(&s,
                     &(scene_params){ .dims = { 8, 8, 8 }, .voxel = few_voxels, .user = &axis });
        s.table[RED] = (trip_tf_entry){ 1, 0, 0, 1.5F };
        s.table[BLUE] = (trip_tf_entry){ 0, 0, 1, 4 };
        trip_camera_params view = scene_view(&s, vector(d), 20, 10, 48);
        view.ortho_height = i / 6 ? 4 : 0;
        trip_settings settings = by(TRIP_COMPOSITING_SHEET);
        scene_turn turn = scene_turns(scene_renderers(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            double max = 0;
            for (int n = 0; n < 48 * 48; n++) {
                trip_vec3 o, ray;
                double expected[3];
                scene_ray(&s, &view, n % 48, n / 48, &o, &ray);
                expected_of_few(&s, axis, d[axis] > 0, o, ray, expected);
                max = fmax(max, expected[2]);
                assert_close(turn.picture.rgba[4 * n], expected[0], 2e-3);
                assert_close(turn.picture.rgba[4 * n + 2], expected[1], 2e-3);
                assert_close(turn.picture.rgba[4 * n + 3], expected[2], 2e-3);
            }
            assert_true(max > 0.9);
        }
        scene_destroy(&s);
    }
}

static void a_slab_has_the_opacity_of_its_voxels_together(void **state)
{
    (void)state;
    for (int i = 0; i < 12; i++) {
        double d[3] = { 0, 0, 0 }, opacity = i / 3 % 2 ? 0.4 : 0.02;
        scene_params params = { .dims = { 40, 40, 40 } };
        params.dims[i % 3] = 9;
        d[i % 3] = i / 6 ? 1 : -1;
        scene s;
        scene_create(&s, &params);
        scene_colour(&s, 65535, 65535, 1, 0.5, 0.25, opacity);
        trip_camera_params view = scene_view(&s, vector(d), 90, 4, 8);
        trip_settings settings = by(TRIP_COMPOSITING_SHEET);
        scene_turn turn = scene_turns(scene_renderers(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            for (int n = 0; n < 64; n++) {
                double alpha = 1 - pow(1 - opacity, 9);
                assert_close(turn.picture.rgba[4 * n + 3] / alpha, 1, 0.01);
                assert_close(turn.picture.rgba[4 * n + 1] / alpha, 0.5, 0.01);
            }
        }
        scene_destroy(&s);
    }
}

/* The fog is so faint that 1 - exp(-x) is lost in single precision. Its 24 sheets have kernels
 * with a ripple of about a hundredth. The cpu renderer rounds a transmittance near 1 at every
 * splat. */
static void faint_fog_is_as_bright_as_the_path_through_it(void **state)
{
    (void)state;
    enum { EDGE = 24 };
    const double faint[] = { 1e-3, 1e-5, 1e-7, 1e-9 };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE } });
    for (int i = 0; i < 8; i++) {
        trip_settings settings = by((trip_compositing)(i % 2));
        trip_camera_params view = scene_view(&s, trip_v3(0, 0, 1), 60, 10, 8);
        view.ortho_height = 6;
        scene_colour(&s, 65535, 65535, 1, 0.5, 0.25, faint[i / 2]);
        scene_turn turn = scene_turns(scene_renderers(), &s, &view, &settings);
        while (scene_take_turn(&turn))
            for (int n = 0; n < 64; n++) {
                const double bright = (double)turn.picture.rgba[4 * n];
                const double path = 1 - pow(1 - faint[i / 2], EDGE);
                const double rounding = strcmp(turn.renderer->name, "cpu") ? 0 : 3e-6;
                if (!(fabs(bright - path) < 0.03 * path + rounding))
                    fail_msg("%s, %g: %g of the path", turn.renderer->name, faint[i / 2],
                             bright / path);
            }
    }
    scene_destroy(&s);
}

/* The eye is inside the volume: the pixel shows the path of its ray from the eye on. */
static void inside_the_volume_splats_before_the_eye_count(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 32, 32, 32 } });
    scene_colour(&s, 65535, 65535, 1, 1, 1, 0.05);
    for (int i = 0; i < 6; i++) {
        double d[3] = { 0, 0, 0 };
        d[i % 3] = i / 3 ? 1 : -1;
        trip_camera_params view = { .eye = { 15.3, 16.1, 14.7 },
                                    .up = { 0.3, 0.5, 0.7 },
                                    .fov_degrees = 20,
                                    .width = 8,
                                    .height = 8 };
        view.look = trip_add(view.eye, vector(d));
        /* The path ends where the last voxel's kernel of half a voxel ends. */
        double to = d[i % 3] > 0 ? 31.5 - trip_component(view.eye, i % 3)
                                 : trip_component(view.eye, i % 3) + 0.5;
        trip_settings settings = by(TRIP_COMPOSITING_SHEET);
        scene_turn turn = scene_turns(scene_renderers(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            assert_close(-log1p(-(double)scene_pixel(&turn.picture, 4, 4)[3]) / -log1p(-0.05) / to,
                         1, 0.02);
        }
    }
    scene_destroy(&s);
}

/* Opaque sheets at 5, 12 and 18 along the axis *user. */
static bool three_sheets(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    int c = (const int[3]){ i, j, k }[*(int *)user];
    (void)gradient;
    *code = c == 5 ? RED : c == 12 ? BLUE : 0;
    return c == 5 || c == 12 || c == 18;
}

static void the_nearest_sheet_hides_those_behind_it(void **state)
{
    (void)state;
    for (int i = 0; i < 12; i++) {
        int axis = i % 3;
        double d[3] = { 0.5, 0.3, -0.4 };
        d[axis] = i / 3 % 2 ? 1 : -1;
        scene s;
        scene_create(&s, &(scene_params){ .dims = { 24, 24, 24 },
                                          .tile_voxels = 16,
                                          .voxel = three_sheets,
                                          .user = &axis });
        scene_colour(&s, 0, 0, 0, 1, 0, 0.9999);
        scene_colour(&s, RED, RED, 1, 0, 0, 0.9999);
        scene_colour(&s, BLUE, BLUE, 0, 0, 1, 0.9999);
        trip_camera_params view = scene_view(&s, vector(d), 60, 20, 16);
        view.ortho_height = i % 4 == 3 ? 8 : 0;
        trip_settings settings = by(TRIP_COMPOSITING_SHEET);
        settings.h = 0.3;
        settings.traversal = i / 6 ? TRIP_TRAVERSAL_ASCENDING : TRIP_TRAVERSAL_OUTWARD;
        scene_turn turn = scene_turns(scene_renderers(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            const float *c = scene_pixel(&turn.picture, 8, 8);
            assert_close(c[0], i / 3 % 2 ? 0 : 1, 0.01);
            assert_close(c[1], i / 3 % 2 ? 1 : 0, 0.01);
            assert_close(c[2], 0, 0.01);
        }
        scene_destroy(&s);
    }
}

static double mean_apart(const scene_picture *a, const scene_picture *b)
{
    double sum = 0;
    int count = 4 * a->width * a->height;
    for (int n = 0; n < count; n++)
        sum += fabs((double)a->rgba[n] - (double)b->rgba[n]);
    return sum / count;
}

static void compare(const scene *s, const trip_camera_params *view, const trip_settings *settings)
{
    scene_picture expected = scene_draw(s, &cpu_scenes_reference, view, settings);
    scene_turn turn = scene_turns(scene_renderers() + 1, s, view, settings);
    while (scene_take_turn(&turn)) {
        double max = scene_difference(&turn.picture, &expected),
               mean = mean_apart(&turn.picture, &expected);
        if (!(max <= 1.0 / 255 && mean <= 0.1 / 255))
            fail_msg("%s: %g of 255 apart, on average %g", turn.renderer->name, 255 * max,
                     255 * mean);
        for (unsigned i = 0; i < s->data->list_count; i++)
            scene_compare_counts(&expected.lists[i], &turn.picture.lists[i], turn.renderer->name);
        for (int n = 0; n < turn.picture.width * turn.picture.height && settings->depth; n++)
            if (expected.rgba[4 * n + 3] > 0.05F)
                assert_true(fabs(turn.picture.depth[n] - expected.depth[n]) <
                            0.005 * expected.depth[n] + 0.01);
    }
    scene_picture_free(&expected);
}

static void every_view_agrees_with_the_reference(void **state)
{
    (void)state;
    const trip_affine sheared = cpu_scenes_sheared();
    for (int grid = 0; grid < 2; grid++) {
        scene s;
        cpu_scenes_blobs(&s, 32, grid ? &sheared : NULL);
        for (int i = 0; i < 8; i++) {
            /* Views from far away, near and inside. */
            trip_camera_params view = scene_view(&s, trip_v3(i - 3.5, 1.2, 0.7 * i - 2),
                                                 i % 4 == 3 ? 6 : 75 - 8 * i, 50 + 5 * i, 50 + i);
            view.ortho_height = i % 4 == 1 ? 40 : 0;
            trip_settings settings = by(TRIP_COMPOSITING_SHEET);
            settings.shading = i % 2;
            settings.method = (trip_method)(i % 3);
            settings.depth = i > 3;
            settings.traversal = i == 6 ? TRIP_TRAVERSAL_ASCENDING : TRIP_TRAVERSAL_OUTWARD;
            compare(&s, &view, &settings);
        }
        scene_destroy(&s);
    }
}

static bool coarse(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    *code = 30000 + 700 * (unsigned)(i + j + k);
    gradient[0] = 0.3;
    return (i + j + k) % 3 > 0;
}

/* Level 0 is drawn near the eye, and the coarse level farther away. Voxels of the coarse level are
 * not cubes. */
static void levels_of_detail_agree_with_the_reference(void **state)
{
    (void)state;
    const scene_part level = { .level = 1, .by = { 2, 2, 1 }, .voxel = coarse };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 24, 24, 24 },
                                      .tile_voxels = 16,
                                      .slab_sheets = 8,
                                      .normals = true,
                                      .voxel = coarse,
                                      .parts = &level,
                                      .part_count = 1 });
    scene_colour(&s, 0, 45000, 0.9, 0.4, 0.1, 0.1);
    scene_colour(&s, 45001, 65535, 0.2, 0.4, 0.9, 0.6);
    for (int i = 0; i < 4; i++) {
        trip_camera_params view = scene_view(&s, trip_v3(1, 0.8 - 0.4 * i, 0.7), 26, 60, 24);
        trip_settings settings = by(TRIP_COMPOSITING_SHEET);
        compare(&s, &view, &settings);
    }
    scene_destroy(&s);
}

/* Layers are rounded once per sheet. */
static void rounded_layers_are_close_to_float_layers(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 32, NULL);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.7, 0.5), 60, 45, 48);
    for (int traversal = 0; traversal < 2; traversal++) {
        trip_settings settings = by(TRIP_COMPOSITING_SHEET);
        settings.traversal = (trip_traversal)traversal;
        scene_picture exact = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
        for (const scene_renderer *r = scene_renderers() + 1; r->name; r++) {
            settings.target = TRIP_TARGET_RGBA16F;
            scene_picture half = scene_draw(&s, r, &view, &settings);
            settings.target = TRIP_TARGET_RGBA8;
            scene_picture eight = scene_draw(&s, r, &view, &settings);
            /* For each of 40 sheets: half a step of 2^-11, and of 1/255. */
            assert_true(scene_difference(&half, &exact) < 41 * 0x1p-12 + 1.0 / 255);
            assert_true(scene_difference(&eight, &exact) < 41 * 0.5 / 255 + 1.0 / 255);
            assert_true(scene_difference(&half, &eight) > 0);
            scene_picture_free(&half);
            scene_picture_free(&eight);
        }
        scene_picture_free(&exact);
    }
    scene_destroy(&s);
}

/* Arranges a volume and its camera: with one axis mirrored, the axes permuted, or turned and moved
 * in world space. */
typedef struct arrangement {
    int64_t dims[3]; /* before mirroring and turning */
    int mirrored;    /* axis; -1 for none */
    int turned;      /* axis a of the arrangement is axis a + turned of the volume */
    trip_affine world;
} arrangement;

static trip_vec3 arrange(const arrangement *to, trip_vec3 p, bool direction)
{
    double first[3] = { p.x, p.y, p.z }, n[3];
    if (to->mirrored >= 0)
        first[to->mirrored] =
            (direction ? 0 : (double)to->dims[to->mirrored] - 1) - first[to->mirrored];
    for (int a = 0; a < 3; a++)
        n[a] = first[(a + to->turned) % 3];
    return direction ? trip_affine_vector(&to->world, vector(n))
                     : trip_affine_point(&to->world, vector(n));
}

/* Pseudo-random voxels, translucent and opaque. */
static bool arranged(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const arrangement *as = user;
    const int at[3] = { i, j, k };
    int first[3];
    (void)gradient;
    for (int a = 0; a < 3; a++)
        first[(a + as->turned) % 3] = at[a];
    if (as->mirrored >= 0)
        first[as->mirrored] = (int)as->dims[as->mirrored] - 1 - first[as->mirrored];
    *code = scene_hash(first[0], first[1], first[2]) & 65535;
    return true;
}

static scene_picture draw_arranged(const scene_renderer *r, const trip_settings *settings,
                                   arrangement as, bool parallel)
{
    scene s;
    scene_params params = { .voxel = arranged, .user = &as, .index_to_world = as.world };
    for (int a = 0; a < 3; a++)
        params.dims[a] = as.dims[(a + as.turned) % 3];
    scene_create(&s, &params);
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ (float)(code % 7) / 6, (float)(code % 11) / 10,
                                         (float)(code % 13) / 12, code % 5 ? 0.03F : 1.5F };
    trip_camera_params view = { .eye = arrange(&as, trip_v3(40, -27, 35), false),
                                .look = arrange(&as, trip_v3(8.2, 9.1, 10.7), false),
                                .up = arrange(&as, trip_v3(0.1, 0.2, 1), true),
                                .fov_degrees = 28,
                                .ortho_height = parallel ? 24 : 0,
                                .width = 40,
                                .height = 40 };
    scene_picture p = scene_draw(&s, r, &view, settings);
    scene_destroy(&s);
    return p;
}

static void flip(scene_picture *p)
{
    for (int y = 0; y < p->height; y++)
        for (int x = 0; x < p->width / 2; x++) {
            float *a = &p->rgba[4 * (y * p->width + x)], kept[4];
            float *b = &p->rgba[4 * (y * p->width + p->width - 1 - x)];
            memcpy(kept, a, sizeof kept);
            memcpy(a, b, sizeof kept);
            memcpy(b, kept, sizeof kept);
        }
}

enum { ARRANGEMENTS = 6 };

/* Returns the largest mean difference between the original volume and the first arrangements.
 * Arrangements are three mirrored volumes, two with permuted axes, and one that is moved. */
static double max_apart(const scene_renderer *r, const trip_settings *settings, bool parallel,
                        int arrangements)
{
    const trip_affine moved = {
        { { 0.36, 0.48, -0.8, 30 }, { -0.8, 0.6, 0, -9 }, { 0.48, 0.64, 0.6, 4 } }
    };
    arrangement as = { { 16, 18, 20 }, -1, 0, trip_affine_identity() };
    scene_picture first = draw_arranged(r, settings, as, parallel);
    double max = 0;
    for (int i = 1; i <= arrangements; i++) {
        as.mirrored = i < 4 ? i - 1 : -1;
        as.turned = i < 4 || i == 6 ? 0 : i - 3;
        as.world = i == 6 ? moved : trip_affine_identity();
        scene_picture p = draw_arranged(r, settings, as, parallel);
        if (as.mirrored >= 0)
            flip(&p);
        max = fmax(max, mean_apart(&p, &first));
        scene_picture_free(&p);
    }
    scene_picture_free(&first);
    return max;
}

/* The test draws by sheets alone. Splats composited one by one depend on their order within a
 * sheet, and the arrangement changes that order. */
static void mirrored_turned_and_moved_volumes_look_the_same(void **state)
{
    (void)state;
    for (const scene_renderer *r = scene_renderers(); r->name; r++)
        for (int parallel = 0; parallel < 2; parallel++) {
            trip_settings settings = by(TRIP_COMPOSITING_SHEET);
            settings.h = 0.3;
            double sheets = max_apart(r, &settings, parallel, ARRANGEMENTS);
            settings.compositing = TRIP_COMPOSITING_SPLAT;
            double splats = max_apart(r, &settings, parallel, 1);
            if (!(sheets < 0.1 / 255 && splats > 0.5 / 255))
                fail_msg("%s: on average %g of 255 apart by sheets, %g by splats", r->name,
                         255 * sheets, 255 * splats);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(splats_of_a_sheet_add_and_sheets_composite),
        cmocka_unit_test(a_slab_has_the_opacity_of_its_voxels_together),
        cmocka_unit_test(faint_fog_is_as_bright_as_the_path_through_it),
        cmocka_unit_test(inside_the_volume_splats_before_the_eye_count),
        cmocka_unit_test(the_nearest_sheet_hides_those_behind_it),
        cmocka_unit_test(every_view_agrees_with_the_reference),
        cmocka_unit_test(levels_of_detail_agree_with_the_reference),
        cmocka_unit_test(rounded_layers_are_close_to_float_layers),
        cmocka_unit_test(mirrored_turned_and_moved_volumes_look_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
