#include "scenes.h"
#include "test.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

#include "plan.h"
#include "plan_cull.h"
#include "splat.h"
#include "weight.h"

/* The number of random cameras, reduced if everything is slower. */
enum { CAMERAS = TEST_BY_TURNS ? 75 : 300, CAMERAS_DRAWN = TEST_BY_TURNS ? 10 : 40 };

static trip_settings unlit(trip_method method, double h)
{
    trip_settings s = trip_settings_default();
    s.method = method;
    s.h = h;
    s.shading = false;
    return s;
}

/* Sparse clumps with codes that depend on the position. */
static bool clumps(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    uint32_t x = scene_hash(i, j, k);
    (void)user;
    (void)gradient;
    *code = (unsigned)((i / 16 * 4 + j / 16 * 2 + k / 16) * 2000) + x % 500;
    return (x >> 20) % 5 == 0;
}

static void make_scene(scene *s)
{
    scene_create(s, &(scene_params){ .dims = { 50, 40, 60 },
                                     .tile_voxels = 16,
                                     .slab_sheets = 4,
                                     .normals = true,
                                     .voxel = clumps });
    scene_colour(s, 0, 65535, 1, 1, 1, 0.2);
}

static trip_plan make_plan(const scene *s, const trip_camera *c, const trip_settings *settings)
{
    trip_plan plan;
    assert_int_equal(trip_plan_make(&plan, s->data, c, settings, s->table, s->budget), 0);
    return plan;
}

static trip_camera make_camera(const scene *s, const trip_camera_params *p)
{
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, p, &s->data->index_to_world), 0);
    return c;
}

static trip_vec3 random_direction(void)
{
    return trip_v3(test_random() * 2 - 1, test_random() * 2 - 1, test_random() * 2 - 1);
}

/* Returns a view from inside or outside, near or far, narrow or wide. */
static trip_camera random_camera(const scene *s, int i)
{
    trip_camera_params p =
        scene_view(s, random_direction(), 1 + 150 * test_random(),
                   i % 3 ? 10 + 60 * test_random() : 90 + 80 * test_random(), 24);
    p.look = trip_add(p.look, trip_scale(random_direction(), 30));
    p.ortho_height = i % 5 == 0 ? 5 + 80 * test_random() : 0;
    p.width = 8 + i % 40;
    return make_camera(s, &p);
}

static void a_list_is_used_exactly_when_some_pixel_has_weight_in_it(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    int used = 0, unused = 0;
    for (int i = 0; i < CAMERAS; i++) {
        trip_camera c = random_camera(&s, i);
        trip_settings settings = unlit((trip_method)(i % 3), i % 4 ? test_random() : 0);
        trip_plan plan = make_plan(&s, &c, &settings);
        for (int axis = 0; axis < 3; axis++) {
            bool weighs = false;
            for (int at = 0; at < c.width * c.height && !weighs; at++) {
                trip_vec3 ray = trip_camera_ray(&c, at % c.width + 0.5, at / c.width + 0.5);
                weighs = trip_weight(&settings, plan.axis_of_view, ray, axis) > 0;
            }
            assert_int_equal(plan.layers[axis].used, weighs);
            used += weighs;
            unused += !weighs;
        }
        trip_plan_release(&plan, s.budget);
    }
    assert_true(used > CAMERAS / 3 && unused > CAMERAS / 3);
    scene_destroy(&s);
}

static void a_parallel_view_along_an_axis_uses_that_list_alone(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    for (int axis = 0; axis < 3; axis++) {
        trip_vec3 d = { axis == 0, axis == 1, axis == 2 };
        trip_camera_params p = scene_view(&s, d, 100, 30, 16);
        p.ortho_height = 70;
        trip_camera c = make_camera(&s, &p);
        trip_settings settings = unlit(TRIP_METHOD_MERGE, 0);
        trip_plan plan = make_plan(&s, &c, &settings);
        for (int a = 0; a < 3; a++) {
            assert_int_equal(plan.layers[a].used, a == axis);
            assert_int_equal(plan.layers[a].pass_count, a == axis);
        }
        assert_int_equal(plan.lists[axis].splats_selected, s.data->header.kept);
        assert_true(
            plan.layers[axis].passes[0].pass.selections[0].descending); /* seen from above */
        assert_true(plan.layers[axis].passes[0].front_to_back);
        trip_plan_release(&plan, s.budget);
    }
    scene_destroy(&s);
}

static void from_inside_each_list_is_read_from_the_eye_outwards(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_camera_params p = scene_view(&s, trip_v3(1, 1, 1), 1, 150, 160);
    p.eye = trip_v3(20.5, 30, -3);
    p.look = trip_v3(40, 10, 30);
    trip_camera c = make_camera(&s, &p);
    trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.3);
    settings.kernel_radius = 2.5; /* and as deep behind the eye: sqrt(2) times as far */
    trip_plan plan = make_plan(&s, &c, &settings);
    const trip_plan_pass *x = plan.layers[0].passes, *y = plan.layers[1].passes;
    assert_int_equal(plan.layers[0].pass_count, 2);
    assert_true(plan.layers[0].parted);
    assert_int_equal(x[0].pass.selections->sheet_first, 17);
    assert_int_equal(x[0].pass.selections->sheet_last, 49);
    assert_false(x[0].pass.selections->descending);
    assert_int_equal(x[1].pass.selections->sheet_first, 0);
    assert_int_equal(x[1].pass.selections->sheet_last, 24);
    assert_true(x[1].pass.selections->descending);
    assert_int_equal(plan.layers[1].pass_count, 2);
    assert_int_equal(y[0].pass.selections->sheet_first, 27);
    assert_int_equal(y[1].pass.selections->sheet_last, 33);
    assert_int_equal(plan.layers[2].pass_count, 2); /* the eye is below all sheets */
    assert_int_equal(plan.layers[2].passes[0].pass.selections[0].sheet_first, 0);
    assert_int_equal(plan.layers[2].passes[1].pass.selections[0].sheet_last, 0);
    trip_plan_release(&plan, s.budget);
    scene_destroy(&s);
}

/* Values near the eye are interpolated from sheets on both sides of it. Gradients read one more
 * sheet if there is one. */
static void in_post_voxels_behind_the_eye_have_no_pass(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_camera_params p = scene_view(&s, trip_v3(1, 1, 1), 1, 150, 160);
    trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.3);
    settings.classify = TRIP_CLASSIFY_POST;
    for (int z = -1; z <= 61; z += 31) { /* before, among and beyond 60 sheets */
        p.eye = trip_v3(20.5, 30.5, z);
        p.look = trip_v3(40, 10, 30);
        const trip_camera c = make_camera(&s, &p);
        trip_plan plan = make_plan(&s, &c, &settings);
        const trip_plan_layer *x = &plan.layers[0], *along = &plan.layers[2];
        assert_int_equal(x->pass_count, 2);
        assert_int_equal(x->passes[0].pass.selections->sheet_first, 19);
        assert_int_equal(x->passes[1].pass.selections->sheet_last, 22);
        assert_int_equal(along->pass_count, z == 30 ? 2 : 1);
        assert_int_equal(along->passes[0].pass.selections->sheet_first, z == 30 ? 28 : 0);
        assert_int_equal(along->passes[0].pass.selections->sheet_last, 59);
        assert_int_equal(along->passes[0].pass.selections->descending, z == 61);
        trip_plan_release(&plan, s.budget);
    }
    scene_destroy(&s);
}

/* Rays in the opposite direction have no weight, so that the plan has no pass for them. If they
 * could not meet the volume anyway, no pixel is masked. */
static void a_direction_without_weighted_rays_has_no_pass(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_camera_params p = scene_view(&s, trip_v3(1, 1, 1), 1, 60, 64);
    p.eye = trip_v3(20.5, 30, 24.2);
    p.look = trip_v3(60, 30, 40);
    trip_camera c = make_camera(&s, &p);
    trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.5);
    trip_plan plan = make_plan(&s, &c, &settings);
    for (int axis = 0; axis < 3; axis += 2) {
        assert_true(axis == 0 || trip_component(trip_camera_ray(&c, 32, 63.5), axis) < 0);
        assert_int_equal(plan.layers[axis].pass_count, 1);
        assert_false(plan.layers[axis].passes[0].pass.selections->descending);
        assert_false(plan.layers[axis].parted);
    }
    assert_int_equal(plan.layers[1].pass_count, 2);
    assert_true(plan.layers[1].parted);
    trip_plan_release(&plan, s.budget);
    p.eye.y = -10;
    c = make_camera(&s, &p);
    plan = make_plan(&s, &c, &settings);
    assert_int_equal(plan.layers[1].pass_count, 1);
    assert_false(plan.layers[1].parted);
    trip_plan_release(&plan, s.budget);
    scene_destroy(&s);
}

static void
ascending_traversal_reads_forwards_and_takes_the_blend_from_the_view_direction(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_camera_params p = scene_view(&s, trip_v3(-1, 1, 1), 100, 30, 16);
    trip_camera c = make_camera(&s, &p);
    trip_settings settings = unlit(TRIP_METHOD_MERGE, 0);
    settings.traversal = TRIP_TRAVERSAL_ASCENDING;
    trip_plan plan = make_plan(&s, &c, &settings);
    for (int axis = 0; axis < 3; axis++) {
        assert_int_equal(plan.layers[axis].pass_count, 1);
        assert_false(plan.layers[axis].passes[0].pass.selections[0].descending);
        assert_int_equal(plan.layers[axis].passes[0].front_to_back, axis == 0);
    }
    trip_plan_release(&plan, s.budget);
    scene_destroy(&s);
}

/* Counts the splats of a list that touch a pixel with weight, from the whole list. In perspective,
 * a splat counts once for each direction of the rays along the axis, because each direction has
 * its own pass. */
static uint64_t count_touching(const scene *s, const trip_camera *c, const trip_settings *settings,
                               int axis_of_view, int axis, bool (*counts)(const scene *s, int code))
{
    trip_splat_frame f = trip_splat_frame_make(c, settings);
    uint64_t n = 0;
    const uint64_t *dims = s->data->header.dims;
    for (uint64_t i = 0; i < dims[0] * dims[1] * dims[2]; i++) {
        int at[3] = { (int)(i % dims[0]), (int)(i / dims[0] % dims[1]),
                      (int)(i / dims[0] / dims[1]) };
        unsigned code;
        double gradient[3];
        trip_splat p;
        if (!clumps(NULL, at[0], at[1], at[2], &code, gradient) || !counts(s, (int)code) ||
            !trip_splat_project(&f, trip_v3(at[0], at[1], at[2]), &p))
            continue;
        bool touches[2] = { false, false };
        for (int y = 0; y < c->height && !(touches[0] && touches[1]); y++) {
            for (int x = 0; x < c->width; x++) {
                trip_vec3 ray = trip_camera_ray(c, x + 0.5, y + 0.5);
                touches[!c->ortho && trip_component(ray, axis) < 0] |=
                    x + 0.5 >= p.x0 && x + 0.5 <= p.x1 && y + 0.5 >= p.y0 && y + 0.5 <= p.y1 &&
                    trip_splat_radius2(&f, &p, x + 0.5, y + 0.5) <= f.cutoff2 &&
                    trip_weight(settings, axis_of_view, ray, axis) > 0;
            }
        }
        n += touches[0] + touches[1];
    }
    return n;
}

static bool any_code(const scene *s, int code)
{
    (void)s;
    (void)code;
    return true;
}

/* The reference counts the splats it receives. The plan must not leave out a splat that touches a
 * pixel. */
static void no_splat_that_touches_a_pixel_is_left_out(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    uint64_t left_out = 0;
    for (int i = 0; i < CAMERAS_DRAWN; i++) {
        trip_camera c = random_camera(&s, i);
        trip_settings settings = unlit((trip_method)(i % 3), i % 4 ? test_random() : 0.85);
        settings.kernel_radius = i % 7 == 0 ? 4 : 2;
        settings.footprint = (trip_footprint)(i / 2 % 2);
        scene_picture p = scene_draw(&s, scene_renderers(), &c.params, &settings);
        int axis_of_view = trip_weight_axis_of_view(&c);
        for (int axis = 0; axis < 3; axis++) {
            assert_int_equal(p.lists[axis].splats_drawn,
                             count_touching(&s, &c, &settings, axis_of_view, axis, any_code));
            left_out += s.data->header.kept - p.lists[axis].splats_read;
        }
        scene_picture_free(&p);
    }
    assert_true(left_out >
                CAMERAS_DRAWN / 2 * s.data->header.kept); /* the bounds must leave out something */
    scene_destroy(&s);
}

/* One visible voxel, either surrounded by others or alone. */
static bool middle_and_corners(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = i == 16 ? 65535 : 0;
    return (i == 16 && j == 16 && k == 16) || (i == 0 && j == 0 && k == 0) ||
           (i == 31 && j == 31 && k == 31);
}

static void make_voxel(scene *s, unsigned tile, unsigned slab)
{
    scene_create(s, &(scene_params){ .dims = { 32, 32, 32 },
                                     .tile_voxels = tile,
                                     .slab_sheets = slab,
                                     .voxel = middle_and_corners });
    scene_colour(s, 65535, 65535, 1, 1, 1, 0.5);
}

/* A ray can miss a voxel before the eye and still pass near it behind the eye, if the voxel is
 * this close. */
static void a_voxel_about_the_eye_is_never_left_out(void **state)
{
    (void)state;
    scene whole, parts;
    int shown = 0;
    make_voxel(&whole, 32, 32);
    make_voxel(&parts, 16, 1);
    for (int i = 0; i < 4 * CAMERAS; i++) {
        const trip_vec3 from = trip_scale(random_direction(), 3);
        trip_camera_params view = { .eye = trip_add(trip_v3(16, 16, 16), from),
                                    .up = { 0.1, 0.2, 1 },
                                    .fov_degrees = 40 + i % 120,
                                    .width = 9,
                                    .height = 6 };
        view.look = trip_add(view.eye, random_direction());
        trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.85);
        settings.footprint = (trip_footprint)(i % 2);
        scene_picture p = scene_draw(&whole, scene_renderers(), &view, &settings);
        scene_picture q = scene_draw(&parts, scene_renderers(), &view, &settings);
        shown += p.lists[0].splats_drawn + p.lists[1].splats_drawn + p.lists[2].splats_drawn > 0;
        assert_true(scene_difference(&p, &q) <= 1e-9);
        scene_picture_free(&p);
        scene_picture_free(&q);
    }
    assert_true(shown > CAMERAS);
    scene_destroy(&whole);
    scene_destroy(&parts);
}

static bool is_visible(const scene *s, int code)
{
    return s->table[code].extinction > 0;
}

static void bricks_that_the_transfer_function_hides_are_not_read(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    scene_colour(&s, 0, 65535, 1, 1, 1, 0);
    scene_colour(&s, 6000, 9000, 1, 1, 1, 0.5);
    trip_camera_params p = scene_view(&s, trip_v3(1, 0.4, 0.3), 150, 40, 32);
    trip_camera c = make_camera(&s, &p);
    trip_settings settings = unlit(TRIP_METHOD_AXIS, 0);
    trip_plan plan = make_plan(&s, &c, &settings);
    assert_true(plan.lists[0].bricks_transparent > plan.lists[0].bricks / 2);
    assert_int_equal(plan.lists[0].bricks,
                     plan.lists[0].bricks_selected + plan.lists[0].bricks_transparent +
                         plan.lists[0].bricks_outside + plan.lists[0].bricks_without_weight);
    uint64_t visible = count_touching(&s, &c, &settings, 0, 0, is_visible);
    assert_true(visible > 0 && plan.lists[0].splats_selected >= visible);
    assert_true(plan.lists[0].splats_selected < s.data->header.kept / 2);
    trip_plan_release(&plan, s.budget);
    scene_destroy(&s);
}

/* A few codes with extinction, and ranges of all lengths around them. */
static void a_brick_is_transparent_when_no_code_of_its_range_has_extinction(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    static const int shown[] = { 255, 256, 3000, 3001, 40000, 65535 };
    scene_colour(&s, 0, 65535, 1, 1, 1, 0);
    for (int i = 0; i < 6; i++)
        scene_colour(&s, shown[i], shown[i], 1, 1, 1, 0.5);
    trip_camera_params p = scene_view(&s, trip_v3(1, 0.4, 0.3), 150, 40, 32);
    trip_camera c = make_camera(&s, &p);
    trip_settings settings = unlit(TRIP_METHOD_AXIS, 0);
    const trip_list_grid grid = { { 1, 1, 1 }, { 0, 0, 0 } };
    trip_code_set set;
    trip_code_set_make(&set, s.table, FLT_TRUE_MIN);
    trip_cull cull = trip_cull_make(s.data, &c, &grid, &settings, 0, &set, NULL);
    trip_file_brick brick = s.data->lists[0].bricks[0];
    const trip_file_slab *slab = s.data->lists[0].slabs;
    for (unsigned i = 0; i < 20000; i++) {
        unsigned first = i * 40503u % 65536, length = i * 7919u % (i % 3 ? 600 : 30000);
        unsigned last = first + length < 65536 ? first + length : 65535;
        bool visible = false;
        for (int k = 0; k < 6; k++)
            visible |= (int)first <= shown[k] && shown[k] <= (int)last;
        brick.code_min = (uint16_t)first;
        brick.code_max = (uint16_t)last;
        assert_int_equal(trip_cull_brick(&cull, 0, &brick, slab) == TRIP_CULL_TRANSPARENT,
                         !visible);
    }
    scene_destroy(&s);
}

static void normals_are_planned_only_for_shading(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_camera_params p = scene_view(&s, trip_v3(1, 0.4, 0.3), 150, 40, 32);
    trip_camera c = make_camera(&s, &p);
    for (int shading = 0; shading < 2; shading++) {
        trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.85);
        settings.shading = shading;
        trip_plan plan = make_plan(&s, &c, &settings);
        assert_int_equal(plan.planes, shading ? 3 : 1);
        trip_plan_release(&plan, s.budget);
    }
    scene_destroy(&s);
}

static void flattened_kernels_take_normals_without_shading_too(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_camera_params p = scene_view(&s, trip_v3(1, 0.4, 0.3), 150, 40, 32);
    trip_camera c = make_camera(&s, &p);
    trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.85);
    settings.footprint = TRIP_FOOTPRINT_EWA;
    settings.flatten = 3;
    trip_plan plan = make_plan(&s, &c, &settings);
    assert_int_equal(plan.planes, 1u << TRIP_PLANE_VOXELS | 1u << TRIP_PLANE_NORMALS);
    trip_plan_release(&plan, s.budget);
    scene_destroy(&s);
}

static char *explain(const scene *s, const trip_camera *c, const trip_settings *settings)
{
    char *text;
    size_t bytes;
    FILE *f = open_memstream(&text, &bytes);
    assert_non_null(f);
    trip_plan plan = make_plan(s, c, settings);
    trip_plan_explain(&plan, s->data, settings, f);
    trip_plan_release(&plan, s->budget);
    fclose(f);
    return text;
}

static void the_plan_explains_its_passes_and_their_reasons(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_camera_params p = scene_view(&s, trip_v3(0, 0, 1), 150, 20, 32);
    trip_camera c = make_camera(&s, &p);
    trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.85);
    char *text = explain(&s, &c, &settings);
    assert_non_null(strstr(text, "list x      not read: no ray of the view has weight in it\n"));
    assert_non_null(strstr(text, "list z      read: "));
    assert_non_null(strstr(text, "sheets 0 to 59 descending, front to back\n"));
    assert_non_null(strstr(text, "shading     does not run: switched off"));
    free(text);
    settings.shading = true;
    settings.method = TRIP_METHOD_AXIS;
    text = explain(&s, &c, &settings);
    assert_non_null(strstr(text, "method      axis: list z alone"));
    assert_non_null(strstr(text, "shading     runs, lit from the eye\n"));
    assert_non_null(strstr(text, "gradients   are the stored normals: normal planes are read, "));
    free(text);
    scene_destroy(&s);
}

/* Splats look up one entry per voxel; `post` looks up integrals. */
static void the_plan_tells_whether_the_transfer_function_is_looked_up(void **state)
{
    (void)state;
    static const char form[] = "integrals   have a closed form: extinction is ";
    scene s;
    make_scene(&s);
    trip_camera_params p = scene_view(&s, trip_v3(0, 0, 1), 150, 20, 32);
    trip_camera c = make_camera(&s, &p);
    trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.85);
    char *text = explain(&s, &c, &settings);
    assert_null(strstr(text, "integrals"));
    free(text);
    settings.classify = TRIP_CLASSIFY_POST;
    for (int i = 0; i < 4; i++) {
        static const char *const why[] = { "constant, colours are constant;",
                                           "linear in the value, or nearly, colours are linear;",
                                           "looked up: extinction is not linear in the value",
                                           "looked up: colours are not linear in the value\n" };
        for (int code = 0; code < 65536; code++) {
            const float x = (float)code / 65535;
            const float k = i == 0 ? 0.5F : i == 2 ? x * x * x * x * x + 0.1F : x + 0.1F;
            s.table[code] = (trip_tf_entry){ i == 0 ? 1 : i == 3 ? x * x : x, 1, 1, k };
        }
        text = explain(&s, &c, &settings);
        assert_non_null(strstr(text, why[i]));
        assert_int_equal(strstr(text, form) != NULL, i < 2);
        free(text);
    }
    scene_destroy(&s);
}

/* A plan keeps its knowledge of a transfer function and does not look again, even if the table has
 * changed, until the caller forgets it. */
static void knowledge_of_a_transfer_function_is_kept_between_plans(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_camera_params p = scene_view(&s, trip_v3(0, 0, 1), 150, 20, 32);
    trip_camera c = make_camera(&s, &p);
    trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.85);
    settings.classify = TRIP_CLASSIFY_POST;
    trip_classification known = { 0 };
    for (int i = 0; i < 6; i++) {
        trip_plan plan;
        if (i == 1) /* constant before, a step now */
            scene_colour(&s, 7000, 65535, 1, 1, 1, 0.5);
        if (i == 4)
            trip_classification_forget_table(&known);
        settings.effects.cueing = i == 2 ? 0.5 : 0;
        settings.kernel = i == 5 ? TRIP_KERNEL_CUBIC : TRIP_KERNEL_LINEAR;
        assert_int_equal(
            trip_plan_make_next(&plan, s.data, &c, &settings, s.table, &known, NULL, s.budget), 0);
        assert_int_equal(plan.not_closed, i == 2  ? TRIP_CLOSED_FORM_EFFECTS
                                          : i < 4 ? TRIP_CLOSED_FORM_FOUND
                                                  : TRIP_CLOSED_FORM_EXTINCTION);
        trip_plan afresh = make_plan(&s, &c, &settings);
        assert_int_equal(plan.code_min, afresh.code_min);
        assert_int_equal(plan.code_max, afresh.code_max);
        trip_plan_release(&plan, s.budget);
        trip_plan_release(&afresh, s.budget);
    }
    scene_destroy(&s);
}

static void grids_one_voxel_thick_have_no_values_between_voxels(void **state)
{
    static const char *const along[] = { "along i", "along j", "along k" };
    (void)state;
    for (int axis = 0; axis < 3; axis++) {
        scene_params params = { .dims = { 20, 20, 20 } };
        params.dims[axis] = 1;
        scene s;
        scene_create(&s, &params);
        scene_colour(&s, 0, 65535, 1, 1, 1, 0.2);
        trip_camera_params view = scene_view(&s, trip_v3(0.3, 0.4, 0.5), 60, 30, 8);
        trip_camera camera = make_camera(&s, &view);
        trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.85);
        trip_plan plan = make_plan(&s, &camera, &settings);
        trip_plan_release(&plan, s.budget);
        settings.classify = TRIP_CLASSIFY_POST;
        test_catch_reports();
        assert_int_equal(trip_plan_make(&plan, s.data, &camera, &settings, s.table, s.budget),
                         TRIP_ERROR);
        assert_one_report(along[axis]);
        scene_destroy(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_list_is_used_exactly_when_some_pixel_has_weight_in_it),
        cmocka_unit_test(a_parallel_view_along_an_axis_uses_that_list_alone),
        cmocka_unit_test(from_inside_each_list_is_read_from_the_eye_outwards),
        cmocka_unit_test(in_post_voxels_behind_the_eye_have_no_pass),
        cmocka_unit_test(a_direction_without_weighted_rays_has_no_pass),
        cmocka_unit_test(
            ascending_traversal_reads_forwards_and_takes_the_blend_from_the_view_direction),
        cmocka_unit_test(no_splat_that_touches_a_pixel_is_left_out),
        cmocka_unit_test(a_voxel_about_the_eye_is_never_left_out),
        cmocka_unit_test(bricks_that_the_transfer_function_hides_are_not_read),
        cmocka_unit_test(a_brick_is_transparent_when_no_code_of_its_range_has_extinction),
        cmocka_unit_test(normals_are_planned_only_for_shading),
        cmocka_unit_test(flattened_kernels_take_normals_without_shading_too),
        cmocka_unit_test(the_plan_explains_its_passes_and_their_reasons),
        cmocka_unit_test(the_plan_tells_whether_the_transfer_function_is_looked_up),
        cmocka_unit_test(knowledge_of_a_transfer_function_is_kept_between_plans),
        cmocka_unit_test(grids_one_voxel_thick_have_no_values_between_voxels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
