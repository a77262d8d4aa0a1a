/* Shadows, occlusion and emission of the gl renderer. Compares each form of submission and each
 * kind of sheet with the reference, and tests the copies of the lattices from frame to frame.
 * The files test_effects.c and test_emission.c test all renderers. */
#include "emission.h"
#include "gl/shared.h"
#include "scenes.h"
#include "test.h"

#include <epoxy/gl.h>
#include <string.h>

static const scene_renderer reference = { "reference", trip_reference_create, 0 };
static const scene_renderer gl = { "gl", trip_gl_create, 1.0 / 255 };

enum { SIZE = 48 };

/* A ball with a soft rim and a hole. */
static bool ball(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const double d[3] = { i - 15.2, j - 13.1, k - 14.6 };
    const double r = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) + 1e-9;
    const double value = fmin(1, fmax(0, (12 - r) / 5));
    (void)user;
    *code = (unsigned)(65535 * value);
    for (int a = 0; a < 3 && value > 0 && value < 1; a++)
        gradient[a] = -d[a] / r / 5;
    return value > 0 && !(d[0] > 3 && d[1] > 2);
}

/* A block of level 1 beside the voxels of level 0. */
static bool block(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 60000;
    return i > 12 && j < 6 && k > 3;
}

static bool rising(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code =
        (unsigned)(6000 * i + 1200 * j + 100 * k) % 45000; /* keeps the sum of all light below 1 */
    return true;
}

static const trip_affine maps[] = {
    { { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } } },
    { { { 0.8, 0.25, 0.05, 3 }, { -0.1, 1.1, 0.4, -7 }, { 0.1, 0.1, 1.4, 1 } } },
    /* Voxels a micrometre wide, in metres, and huge ones. Floats must not overflow or underflow. */
    { { { 0.6e-6, -0.8e-6, 0, 0.01 }, { 0.8e-6, 0.6e-6, 0, -0.02 }, { 0, 0, 1e-6, 0.03 } } },
    { { { 0, 0, 1e9, 0 }, { 0, 1e9, 0, 0 }, { -1e9, 0, 0, 0 } } },
};

typedef struct lit_scene {
    scene s, heat;
    const trip_affine *map;
    double unit; /* about a voxel, in world units */
} lit_scene;

static void create(lit_scene *l, const trip_affine *map, int cells)
{
    const scene_part part = { .level = 1, .by = { 2, 2, 2 }, .voxel = block };
    trip_affine of_heat = *map;
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < 3; k++)
            of_heat.m[a][k] *= 3;
    l->map = map;
    l->unit = cbrt(fabs(trip_affine_determinant(map)));
    scene_create(&l->s, &(scene_params){ .dims = { 34, 30, 32 },
                                         .index_to_world = *map,
                                         .tile_voxels = 16,
                                         .normals = true,
                                         .gradient_scale = 1 / l->unit,
                                         .voxel = ball,
                                         .parts = &part,
                                         .part_count = 1 });
    for (int code = 0; code < 65536; code++)
        l->s.table[code] =
            (trip_tf_entry){ 0.3F, 0.2F, 0.1F, (float)(0.4 * code / 65535 / l->unit) };
    scene_create(&l->heat, &(scene_params){
                               .dims = { 10, 9, 12 }, .index_to_world = of_heat, .voxel = rising });
    assert_int_equal(trip_emission_create(&l->s.emission, l->heat.path, l->s.budget), 0);
    assert_int_equal(
        trip_emission_begin(l->s.emission,
                            &(trip_emission_params){ .index_to_world = &l->s.data->index_to_world,
                                                     .kelvin = { 300, 2400 },
                                                     .cells = cells,
                                                     .threads = 1 }),
        0);
}

static void destroy(lit_scene *l)
{
    trip_emission_destroy(l->s.emission);
    scene_destroy(&l->heat);
    scene_destroy(&l->s);
}

static trip_settings with_all(const lit_scene *l, trip_classify classify)
{
    trip_settings s = trip_settings_default();
    s.classify = classify;
    s.headlight = false;
    s.light_direction = trip_normalize(trip_v3(0.8, -0.3, 0.6));
    s.light_position = trip_affine_point(l->map, trip_v3(9, 24.3, 20.1));
    s.effects = (trip_effects){ .shadows = true,
                                .occlusion = true,
                                .emission = true,
                                .cueing = 0.3,
                                .anisotropy = 0.2,
                                .cells = 20 };
    return s;
}

static void compare(const char *label, const lit_scene *l, const trip_camera_params *view,
                    const trip_settings *settings)
{
    scene_picture a = scene_draw(&l->s, &reference, view, settings);
    scene_picture b = scene_draw(&l->s, &gl, view, settings);
    double max = scene_difference(&a, &b);
    print_message("%-28s most %.4f of 1/255\n", label, 255 * max);
    assert_true(max <= scene_bound(settings));
    scene_picture_free(&a);
    scene_picture_free(&b);
}

static const trip_classify both[] = { TRIP_CLASSIFY_PRE, TRIP_CLASSIFY_POST };
static const char *const class_names[] = { "pre", "post" };

/* Effects alone and combined, with and without surfaces. */
static void every_set_of_effects_agrees_with_the_reference(void **state)
{
    (void)state;
    lit_scene l;
    create(&l, &maps[1], 0);
    for (int n = 0; n < 32; n++) {
        trip_camera_params view = scene_view(&l.s, trip_v3(0.4, -1, 0.5), 80, 28, SIZE);
        trip_settings settings = with_all(&l, both[n / 16]);
        char label[64];
        snprintf(label, sizeof label, "%s, effects %d", class_names[n / 16], n % 16);
        settings.effects.shadows = n & 1;
        settings.effects.occlusion = n & 2;
        settings.effects.emission = n & 4;
        settings.shading = n & 8;
        settings.headlight = !settings.effects.shadows && n & 4;
        settings.point_light = n & 2;
        compare(label, &l, &view, &settings);
    }
    destroy(&l);
}

static void grids_of_any_shape_agree_with_the_reference(void **state)
{
    (void)state;
    for (int i = 0; i < 8; i++) {
        lit_scene l;
        create(&l, &maps[i / 2], 5);
        trip_camera_params view = scene_view(&l.s, trip_v3(-1, 0.6, -0.5), 80 * l.unit, 28, SIZE);
        trip_settings settings = with_all(&l, both[i % 2]);
        compare(class_names[i % 2], &l, &view, &settings);
        view.ortho_height = 40 * l.unit;
        settings.point_light = true;
        compare("light in the volume, parallel", &l, &view, &settings);
        destroy(&l);
    }
}

/* Views from as far as a thousand million voxels, and from inside. */
static void inside_and_far_views_agree_with_the_reference(void **state)
{
    (void)state;
    lit_scene l;
    create(&l, &maps[0], 0);
    for (int i = 0; i < 6; i++) {
        const double distance = i / 2 == 0 ? 6 : i / 2 == 1 ? 1e5 : 1e9;
        trip_camera_params view =
            scene_view(&l.s, trip_v3(0.9, 0.8, 0.7), distance,
                       i / 2 == 0 ? 100 : 2 * atan(20 / distance) * 180 / 3.14159265358979, SIZE);
        trip_settings settings = with_all(&l, both[i % 2]);
        if (view.fov_degrees < 1e-5)
            view.ortho_height = 40; /* parallel, also from inside */
        compare(i / 2 == 0 ? "within" : "far away", &l, &view, &settings);
    }
    destroy(&l);
}

/* Sprites and triangles, lists and one array, splat by splat and by sheets, clipping, levels of
 * detail and flat kernels. In `post`, samples per sheet and kernels of values. */
static void every_form_agrees_with_the_reference(void **state)
{
    (void)state;
    lit_scene l;
    create(&l, &maps[1], 0);
    const trip_camera_params view = scene_view(&l.s, trip_v3(0.9, 0.8, 0.7), 80, 28, SIZE);
    for (int form = 0; form < 10; form++) {
        trip_settings settings = with_all(&l, both[form / 7]);
        char label[32];
        snprintf(label, sizeof label, "form %d", form);
        settings.triangles = form < 4 && form & 1;
        settings.indexed = form < 4 && form & 2;
        if (form == 4)
            settings.compositing = TRIP_COMPOSITING_SHEET;
        if (form == 5) {
            settings.footprint = TRIP_FOOTPRINT_EWA;
            settings.flatten = 2;
        }
        if (form == 6 || form == 7)
            settings.clip = (trip_clip){ .planes = { { trip_v3(1, 0, 0), -10 } }, .count = 1 };
        if (form == 6)
            settings.lod_px = 4;
        if (form >= 8)
            settings.kernel = form == 8 ? TRIP_KERNEL_CUBIC : TRIP_KERNEL_GAUSSIAN;
        settings.samples_per_sheet = form == 9 ? 5 : 2;
        compare(label, &l, &view, &settings);
    }
    destroy(&l);
}

/* Frames of one view, drawn by one renderer with its reader, light and plan. */
typedef struct desk {
    const lit_scene *l;
    trip_renderer *renderer;
    trip_light_map *light;
    trip_camera camera;
    uint64_t leave; /* memory left after all other allocations; 0 for all */
} desk;

static int draw(desk *d, const trip_settings *settings, float *rgba)
{
    const scene *s = &d->l->s;
    trip_reader *reader;
    trip_plan plan;
    trip_frame_stats stats;
    assert_int_equal(trip_plan_make(&plan, s->data, &d->camera, settings, s->table, s->budget), 0);
    assert_int_equal(trip_reader_create(&reader, s->data,
                                        &(trip_reader_params){ .planes = plan.planes }, s->budget),
                     0);
    const trip_light_source source = {
        .data = s->data, .settings = settings, .clip = &plan.clip, .table = s->table, .threads = 1
    };
    const bool lit = trip_effects_light(&settings->effects);
    if (lit)
        assert_int_equal(trip_light_map_begin(d->light, &source), 0);
    const trip_frame frame = { .data = s->data,
                               .camera = &d->camera,
                               .settings = settings,
                               .plan = &plan,
                               .table = s->table,
                               .light = lit ? d->light : NULL,
                               .emission = s->emission };
    const uint64_t taken = d->leave ? trip_budget_left_bytes(s->budget) - d->leave : 0;
    assert_true(trip_budget_charge(s->budget, taken));
    const int status = trip_frame_draw(d->renderer, reader, &frame, rgba, NULL, &stats);
    trip_budget_discharge(s->budget, taken);
    trip_reader_destroy(reader);
    trip_plan_release(&plan, s->budget);
    return status;
}

static void set_up(desk *d, const lit_scene *l)
{
    const trip_camera_params view = scene_view(&l->s, trip_v3(0.4, -1, 0.5), 80, 28, SIZE);
    *d = (desk){ .l = l };
    assert_int_equal(trip_gl_create(&d->renderer, l->s.budget), 0);
    assert_int_equal(trip_light_map_create(&d->light, l->s.budget), 0);
    assert_int_equal(trip_camera_make(&d->camera, &view, &l->s.data->index_to_world), 0);
}

static void put_away(desk *d)
{
    d->renderer->ops->destroy(d->renderer);
    trip_light_map_destroy(d->light);
}

/* After a change of light, transfer function, effect or lattice, the renderer must not use the
 * previous copy, even if the size is the same. */
static void a_changed_lattice_is_copied_anew(void **state)
{
    static float kept[4 * SIZE * SIZE], fresh[4 * SIZE * SIZE], before[4 * SIZE * SIZE];
    (void)state;
    lit_scene l;
    desk d;
    create(&l, &maps[0], 0);
    set_up(&d, &l);
    trip_settings settings = with_all(&l, TRIP_CLASSIFY_PRE);
    for (int n = 0; n < 9; n++) {
        switch (n) {
        case 1:
            settings.light_direction = trip_v3(0, 1, 0);
            break;
        case 2:
            settings.point_light = true;
            break;
        case 3:
            for (int code = 0; code < 65536; code++)
                l.s.table[code].extinction *= 2;
            break;
        case 4:
            settings.effects.shadows = false;
            break;
        case 5:
            settings.effects.shadows = true;
            settings.effects.occlusion = false;
            break;
        case 6: /* possibly at the same address */
            trip_light_map_destroy(d.light);
            assert_int_equal(trip_light_map_create(&d.light, l.s.budget), 0);
            settings.light_position.x -= 3;
            break;
        case 7:
            settings.effects.cells = 9;
            break;
        case 8:
            settings.classify = TRIP_CLASSIFY_POST;
            break;
        default:
            break;
        }
        desk other;
        set_up(&other, &l);
        assert_int_equal(draw(&d, &settings, kept), 0);
        assert_int_equal(draw(&other, &settings, fresh), 0);
        assert_memory_equal(kept, fresh, sizeof kept);
        if (n > 0)
            assert_true(memcmp(kept, before, sizeof kept) != 0);
        memcpy(before, kept, sizeof kept);
        put_away(&other);
    }
    put_away(&d);
    destroy(&l);
}

/* Counts the copies and bindings on the device for effects. */
static struct {
    unsigned copies, textures, blocks;
    PFNGLTEXTURESUBIMAGE3DPROC copy;
    PFNGLBINDTEXTUREUNITPROC bind_texture;
    PFNGLBINDBUFFERRANGEPROC bind_block;
} device;

static void counting_copy(GLuint texture, GLint level, GLint x, GLint y, GLint z, GLsizei width,
                          GLsizei height, GLsizei depth, GLenum format, GLenum type,
                          const void *pixels)
{
    device.copies++;
    device.copy(texture, level, x, y, z, width, height, depth, format, type, pixels);
}

static void counting_bind_texture(GLuint unit, GLuint texture)
{
    device.textures += unit >= TRIP_GL_LIGHT_REACHED;
    device.bind_texture(unit, texture);
}

static void counting_bind_block(GLenum target, GLuint index, GLuint buffer, GLintptr offset,
                                GLsizeiptr size)
{
    device.blocks += target == GL_UNIFORM_BUFFER && index == TRIP_GL_EFFECTS;
    device.bind_block(target, index, buffer, offset, size);
}

static void watch(bool watched)
{
    if (watched) {
        device.copy = epoxy_glTextureSubImage3D;
        device.bind_texture = epoxy_glBindTextureUnit;
        device.bind_block = epoxy_glBindBufferRange;
    }
    epoxy_glTextureSubImage3D = watched ? counting_copy : device.copy;
    epoxy_glBindTextureUnit = watched ? counting_bind_texture : device.bind_texture;
    epoxy_glBindBufferRange = watched ? counting_bind_block : device.bind_block;
}

/* A lattice is copied once. Without effects nothing is copied or bound. */
static void unneeded_lattices_are_not_copied(void **state)
{
    static float rgba[4 * SIZE * SIZE];
    (void)state;
    lit_scene l;
    desk d;
    create(&l, &maps[0], 0);
    for (int n = 0; n < 2; n++) {
        set_up(&d, &l);
        trip_settings settings = with_all(&l, both[n]), plain = settings;
        plain.effects = (trip_effects){ .cells = 20 };
        assert_int_equal(draw(&d, &settings, rgba), 0); /* resolves the functions of GL */
        assert_int_equal(draw(&d, &plain, rgba), 0);
        watch(true);
        const unsigned copies[] = { 0, 3, 0, 0, 0, 3, 1 };
        for (int frame = 0; frame < 7; frame++) {
            const bool runs = frame > 0 && frame != 4;
            device.copies = device.textures = device.blocks = 0;
            if (frame == 3) /* another view */
                d.camera.eye.x += 2;
            if (frame == 6) { /* heat unchanged */
                settings.light_direction = trip_v3(0, 1, 0);
                settings.effects.occlusion = false;
            }
            assert_int_equal(draw(&d, runs ? &settings : &plain, rgba), 0);
            assert_int_equal(device.copies, copies[frame]);
            assert_true((device.textures > 0) == runs && (device.blocks > 0) == runs);
        }
        plain.effects.cueing = 0.5; /* cueing needs positions alone */
        device.copies = device.textures = 0;
        assert_int_equal(draw(&d, &plain, rgba), 0);
        assert_int_equal(device.copies + device.textures, 0);
        watch(false);
        put_away(&d);
    }
    destroy(&l);
}

/* Returns the number of nodes of a lattice with cells of a given number of voxels along each axis.
 */
static uint64_t nodes_over(const trip_dataset *data, int cells, int stride)
{
    const trip_light_grid grid = trip_light_grid_over(data->header.dims, cells, stride);
    return trip_light_grid_count(&grid);
}

/* A node of each lattice takes 4 bytes while effects are on, and none afterwards. */
static void lattices_count_against_the_memory_limit(void **state)
{
    static float rgba[4 * SIZE * SIZE];
    (void)state;
    lit_scene l;
    desk d;
    create(&l, &maps[0], 0);
    set_up(&d, &l);
    trip_settings settings = with_all(&l, TRIP_CLASSIFY_PRE), plain = settings;
    plain.effects = (trip_effects){ .cells = 20 };
    for (int n = 0; n < 4; n++) /* each allocates one buffer for batches */
        assert_int_equal(draw(&d, &settings, rgba), 0);
    const uint64_t with = trip_budget_left_bytes(l.s.budget);
    assert_int_equal(draw(&d, &plain, rgba), 0);
    const uint64_t nodes = nodes_over(l.s.data, 20, 1) + nodes_over(l.s.data, 20, 2) + 10 * 9 * 12;
    assert_int_equal(trip_budget_left_bytes(l.s.budget) - with, 4 * nodes);

    d.leave = 4 * nodes - 1;
    test_catch_reports();
    assert_true(draw(&d, &settings, rgba) < 0);
    assert_one_report("does not fit the memory given");
    d.leave = 4 * nodes;
    assert_int_equal(draw(&d, &settings, rgba), 0);
    put_away(&d);
    destroy(&l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_set_of_effects_agrees_with_the_reference),
        cmocka_unit_test(grids_of_any_shape_agree_with_the_reference),
        cmocka_unit_test(inside_and_far_views_agree_with_the_reference),
        cmocka_unit_test(every_form_agrees_with_the_reference),
        cmocka_unit_test(a_changed_lattice_is_copied_anew),
        cmocka_unit_test(unneeded_lattices_are_not_copied),
        cmocka_unit_test(lattices_count_against_the_memory_limit),
    };
    if (!scene_has_gl())
        return 77;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
