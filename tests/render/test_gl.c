/* Compares the gl renderer with the reference: forms of submission, methods, targets, limits of a
 * driver, and missing resources. The file test_gl_views.c draws real data. The file
 * test_reference.c tests the order of layers and the opacity of bodies with all renderers. */
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "scenes.h"
#include "splat.h"
#include "test.h"

#include "comma_locale.h"

static const scene_renderer reference = { "reference", trip_reference_create, 0 };
static const scene_renderer gl = { "gl", trip_gl_create, 1.0 / 255 };

/* Shells of changing colour with a hole in them. Every voxel has a gradient. */
static bool shells(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    double x = i - 20.5, y = j - 17.2, z = k - 19.1, r = sqrt(x * x + y * y + z * z) + 1e-9;
    double slope = -0.35 * sin(0.7 * r);
    *code = (unsigned)(65535 * (0.5 + 0.5 * cos(0.7 * r)));
    gradient[0] = slope * x / r;
    gradient[1] = slope * y / r;
    gradient[2] = slope * z / r;
    return r < 17 && !(x > 2 && y > 3);
}

static const trip_affine cubes = { { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } } };
static const trip_affine boxes = { { { 0.7, 0, 0, 5 }, { 0, 1.2, 0, -9 }, { 0, 0, 2.1, 2 } } };
static const trip_affine sheared = {
    { { 0.8, 0.25, 0.05, 3 }, { -0.1, 1.1, 0.4, -7 }, { 0.1, 0.1, 1.4, 1 } }
};
/* A rotated grid of voxels a micrometre wide, in metres. Floats must not overflow or underflow. */
static const trip_affine tiny = {
    { { 0.6e-6, -0.8e-6, 0, 0.01 }, { 0.8e-6, 0.6e-6, 0, -0.02 }, { 0, 0, 1e-6, 0.03 } }
};

static void make_shells(scene *s, const trip_affine *index_to_world)
{
    scene_create(s, &(scene_params){ .dims = { 41, 36, 38 },
                                     .index_to_world = *index_to_world,
                                     .tile_voxels = 16,
                                     .normals = true,
                                     .voxel = shells });
    scene_colour(s, 0, 20000, 0.2, 0.5, 1, 0.02);
    scene_colour(s, 20001, 45000, 0.9, 0.4, 0.1, 0.2);
    scene_colour(s, 45001, 65535, 1, 1, 0.6, 0.8);
}

static double mean_difference(const scene_picture *a, const scene_picture *b)
{
    double sum = 0;
    size_t count = 4 * (size_t)a->width * (size_t)a->height;
    for (size_t i = 0; i < count; i++)
        sum += fabs((double)a->rgba[i] - (double)b->rgba[i]);
    return sum / (double)count;
}

static void assert_same_counts(const scene_picture *a, const scene_picture *b)
{
    for (int axis = 0; axis < 3; axis++) {
        const trip_list_stats *l = &a->lists[axis], *m = &b->lists[axis];
        assert_int_equal(l->splats_read, m->splats_read);
        assert_int_equal(l->splats_projected, m->splats_projected);
        assert_int_equal(l->splats_drawn, m->splats_drawn);
    }
}

static void assert_agrees(const char *label, const scene_picture *a, const scene_picture *b,
                          const trip_settings *settings)
{
    double max = scene_difference(a, b), mean = mean_difference(a, b);
    print_message("%-36s most %.4f mean %.5f of 1/255\n", label, 255 * max, 255 * mean);
    assert_true(max <= scene_bound(settings));
}

static void compare(const char *label, const scene *s, const trip_camera_params *view,
                    const trip_settings *settings)
{
    scene_picture a = scene_draw(s, &reference, view, settings);
    scene_picture b = scene_draw(s, &gl, view, settings);
    assert_agrees(label, &a, &b, settings);
    assert_same_counts(&a, &b);
    scene_picture_free(&a);
    scene_picture_free(&b);
}

static void submission_forms_give_the_same_picture_and_counts(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &cubes);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.8, 0.5), 80, 40, 120);
    trip_settings settings = trip_settings_default();
    scene_picture expected = scene_draw(&s, &reference, &view, &settings);
    for (int form = 0; form < 6; form++) {
        static const char *const names[] = { "replicated sprites", "replicated triangles",
                                             "indexed sprites",    "indexed triangles",
                                             "resident sprites",   "resident triangles" };
        settings.triangles = form & 1;
        settings.indexed = form / 2 == 1;
        settings.resident = form / 2 == 2;
        scene_picture p = scene_draw(&s, &gl, &view, &settings);
        assert_agrees(names[form], &expected, &p, &settings);
        assert_same_counts(&expected, &p);
        assert_true((p.stats.reader.bytes_read == 0) == (form > 1)); /* lists that stay */
        scene_picture_free(&p);
    }
    scene_picture_free(&expected);
    scene_destroy(&s);
}

/* The reference counts by trip_weight_of_two_points(), which test_weight.c compares with a closed
 * form. */
static void two_points_cull_as_in_the_reference(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &cubes);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.9, 0.8), 50, 60, 101);
    trip_settings settings = trip_settings_default();
    settings.two_point_culling = true;
    scene_picture two = scene_draw(&s, &reference, &view, &settings);
    compare("two points", &s, &view, &settings);
    settings.indexed = true;
    compare("two points, indexed", &s, &view, &settings);
    settings = trip_settings_default();
    scene_picture all = scene_draw(&s, &reference, &view, &settings);
    assert_true(two.stats.all.splats_projected < all.stats.all.splats_projected);
    scene_picture_free(&two);
    scene_picture_free(&all);
    scene_destroy(&s);
}

static void without_culling_every_brick_is_read_and_the_picture_stays(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &cubes);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.9, 0.8), 12, 40, 101);
    trip_settings settings = trip_settings_default();
    for (int i = 0; i < 3; i++) {
        const scene_renderer *r = i ? &gl : &reference;
        settings.indexed = i == 2;
        settings.unculled = false;
        scene_picture some = scene_draw(&s, r, &view, &settings);
        settings.unculled = true;
        scene_picture all = scene_draw(&s, r, &view, &settings);
        assert_true(scene_difference(&some, &all) <= 1e-5);
        assert_int_equal(some.stats.all.splats_drawn, all.stats.all.splats_drawn);
        assert_true(some.stats.all.splats_read < all.stats.all.splats_read);
        scene_picture_free(&some);
        scene_picture_free(&all);
    }
    scene_destroy(&s);
}

static void every_method_and_traversal_agrees_with_the_reference(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &cubes);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.9, 0.8), 50, 60, 101);
    trip_settings settings = trip_settings_default();
    settings.method = TRIP_METHOD_CLIP;
    compare("clip", &s, &view, &settings);
    settings.method = TRIP_METHOD_AXIS;
    compare("axis", &s, &view, &settings);
    settings.method = TRIP_METHOD_MERGE;
    settings.h = 0;
    compare("merge, h 0", &s, &view, &settings);
    settings.traversal = TRIP_TRAVERSAL_ASCENDING;
    compare("ascending, back to front", &s, &view, &settings);
    scene_destroy(&s);
}

/* The voxel's splat covers the picture, and its light has no direction. */
static void a_voxel_at_the_eye_is_lit_like_in_the_reference(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &cubes);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.8, 0.5), 80, 60, 40);
    trip_settings settings = trip_settings_default();
    view.eye = trip_affine_point(&cubes, trip_v3(5, 14, 13));
    compare("light from the eye", &s, &view, &settings);
    settings.headlight = false;
    settings.light_direction = trip_normalize(trip_v3(1, -2, 1));
    compare("directional light", &s, &view, &settings);
    scene_destroy(&s);
}

static void grids_that_are_not_cubic_agree_with_the_reference(void **state)
{
    (void)state;
    const trip_affine *grids[] = { &boxes, &sheared, &tiny };
    static const char *const names[] = { "anisotropic", "sheared", "micrometres" };
    trip_settings settings = trip_settings_default();
    for (int i = 0; i < 3; i++) {
        scene s;
        char label[64];
        make_shells(&s, grids[i]);
        double size = cbrt(fabs(trip_affine_determinant(grids[i]))) * 40;
        trip_camera_params view = scene_view(&s, trip_v3(0.5, 1, 0.7), 1.8 * size, 45, 60);
        compare(names[i], &s, &view, &settings);
        view.ortho_height = 1.3 * size;
        snprintf(label, sizeof label, "%s, parallel", names[i]);
        compare(label, &s, &view, &settings);
        view.ortho_height = 0;
        view.eye = trip_add(view.look, trip_scale(trip_v3(0.1, 0.07, 0.03), size));
        view.fov_degrees = 160;
        snprintf(label, sizeof label, "%s, from inside, 160 degrees", names[i]);
        compare(label, &s, &view, &settings);
        scene_destroy(&s);
    }
}

static void light_and_kernel_settings_agree_with_the_reference(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &sheared);
    trip_camera_params view = scene_view(&s, trip_v3(-1, 0.4, 0.6), 70, 40, 100);
    trip_settings settings = trip_settings_default();
    settings.headlight = false;
    settings.light_direction = trip_normalize(trip_v3(1, -2, 1));
    compare("directional light", &s, &view, &settings);
    settings.light_direction = trip_normalize(trip_v3(1, -0.2, -0.4));
    compare("light from behind", &s, &view, &settings);
    settings.point_light = true;
    settings.light_position = trip_affine_point(&sheared, trip_v3(8, 31, 26.5));
    compare("light in the volume", &s, &view, &settings);
    view.ortho_height = 50;
    compare("light in the volume, parallel", &s, &view, &settings);
    view.ortho_height = 0;
    settings.point_light = false;
    settings.shading = false;
    settings.background[0] = 0.8;
    settings.background[3] = 0.5;
    compare("no light, background", &s, &view, &settings);
    settings.kernel_radius = 1.2;
    compare("small kernel", &s, &view, &settings);
    settings.kernel_radius = 3.5;
    compare("large kernel", &s, &view, &settings);
    scene_destroy(&s);
}

static void supports_larger_than_sprites_are_drawn_as_triangles(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &cubes);
    trip_settings settings = trip_settings_default();
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.3, 0.2), 22, 14, 300);
    compare("magnified, 300 px", &s, &view, &settings);
    view.ortho_height = 3;
    compare("magnified, 300 px, parallel", &s, &view, &settings);
    scene_destroy(&s);
}

static void splats_with_centres_out_of_view_are_drawn(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &cubes);
    trip_settings settings = trip_settings_default();
    /* One voxel fills the image. All other splats that reach the image have their centres outside.
     */
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.3, 0.2), 30, 2, 40);
    compare("within a voxel", &s, &view, &settings);
    scene_destroy(&s);
}

static void the_size_of_batches_makes_no_difference(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &cubes);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.8, 0.5), 80, 40, 64);
    trip_settings settings = trip_settings_default();
    for (int indexed = 0; indexed < 2; indexed++) {
        settings.indexed = indexed;
        scene_picture large = scene_draw(&s, &gl, &view, &settings);
        scene_picture small = scene_draw_with(
            &s, &gl, &view, &settings, &(trip_reader_params){ .slots = 2, .slot_bytes = 4096 });
        assert_true(scene_difference(&large, &small) == 0);
        scene_picture_free(&large);
        scene_picture_free(&small);
    }
    scene_destroy(&s);
}

/* Draws a few frames with one renderer, the last one to `rgba`. The ring lies in GL memory if the
 * renderer offers it. Returns true if reads land there. */
static bool draw_in_place(const scene *s, const trip_camera_params *view, trip_reader_params params,
                          float *rgba)
{
    trip_renderer *r;
    trip_reader *reader;
    trip_camera camera;
    trip_plan plan;
    trip_frame_stats stats;
    trip_settings settings = trip_settings_default();
    assert_int_equal(trip_gl_create(&r, s->budget), 0);
    assert_int_equal(trip_camera_make(&camera, view, &s->data->index_to_world), 0);
    assert_int_equal(trip_plan_make(&plan, s->data, &camera, &settings, s->table, s->budget), 0);
    params.planes = plan.planes;
    assert_int_equal(plan.planes, 3);
    params.slot_bytes = trip_reader_slot_bytes(s->data, params.planes, params.slot_bytes);
    params.slot_memory = r->ops->take_slots(r, params.slots, params.slot_bytes);
    if (params.slot_memory && !trip_reader_probe(s->data, params.engine, params.slot_memory[0])) {
        r->ops->drop_slots(r);
        params.slot_memory = NULL;
    }
    assert_int_equal(trip_reader_create(&reader, s->data, &params, s->budget), 0);
    trip_frame frame = {
        .data = s->data, .camera = &camera, .settings = &settings, .plan = &plan, .table = s->table
    };
    for (int i = 0; i < 3; i++)
        assert_int_equal(trip_frame_draw(r, reader, &frame, rgba, NULL, &stats), 0);
    trip_reader_destroy(reader);
    trip_plan_release(&plan, s->budget);
    r->ops->destroy(r);
    return params.slot_memory;
}

static void reads_into_gl_memory_give_the_same_picture_as_copies(void **state)
{
    enum { SIZE = 64 };
    static float rgba[SIZE * SIZE * 4];
    (void)state;
    scene s;
    make_shells(&s, &cubes);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.8, 0.5), 80, 40, SIZE);
    trip_settings settings = trip_settings_default();
    scene_picture copied = scene_draw(&s, &gl, &view, &settings);
    const unsigned slots[] = { 2, 3, 8 };
    const size_t slot_bytes[] = { 16384, 4096, 65536 };
    for (int i = 0; i < 12; i++) {
        trip_reader_params params = { .slots = slots[i % 3],
                                      .slot_bytes = slot_bytes[i % 3],
                                      .engine = (trip_engine)(i / 3) };
        if (params.engine == TRIP_ENGINE_URING)
            continue; /* the form that `auto` selects, or a refused one */
        bool copy = i % 2;
        setenv("TRIPTYCH_GL_SLOTS", copy ? "copy" : "mapped", 1);
        bool in_place = draw_in_place(&s, &view, params, rgba);
        unsetenv("TRIPTYCH_GL_SLOTS");
        if (copy)
            assert_false(in_place);
        else if (!in_place)
            test_lacks("memory of the driver's that reads land in");
        assert_memory_equal(rgba, copied.rgba, sizeof rgba);
    }
    scene_picture_free(&copied);
    scene_destroy(&s);
}

enum { SPECKS = 14 };

/* Few voxels, so that few splats overlap. */
static bool is_speck(int i, int j, int k)
{
    return (7 * i + 13 * j + 5 * k) % 11 == 0;
}

static bool specks(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 20000u * (unsigned)((i + j + k) % 3);
    return is_speck(i, j, k);
}

/* Returns the number of splats that reach a position of the picture. */
static unsigned overlap_at(const trip_splat_frame *f, double x, double y)
{
    unsigned n = 0;
    for (int v = 0; v < SPECKS * SPECKS * SPECKS; v++) {
        const int i = v % SPECKS, j = v / SPECKS % SPECKS, k = v / (SPECKS * SPECKS);
        trip_splat splat;
        n += is_speck(i, j, k) && trip_splat_project(f, trip_v3(i, j, k), &splat) &&
             trip_splat_radius2(f, &splat, x, y) <= f->cutoff2;
    }
    return n;
}

/* A blend adds an error of at most a step of the target. A driver may round the colour and the
 * product, half a step each, or cut off the rest. n blends add up to n steps in colour. In alpha
 * they change the transmittance, which adds at most as much again. Merging averages the layers. */
static void targets_are_off_by_at_most_two_steps_a_splat(void **state)
{
    static const char *const names[] = { "rgba32f", "rgba16f", "rgba8" };
    const double steps[] = { 0, 1.0 / 2048, 1.0 / 255 };
    (void)state;
    scene s;
    trip_camera camera;
    scene_create(&s, &(scene_params){
                         .dims = { SPECKS, SPECKS, SPECKS }, .tile_voxels = 16, .voxel = specks });
    scene_colour(&s, 0, 19999, 0.9, 0.3, 0.1, 0.02);
    scene_colour(&s, 20000, 39999, 0.2, 0.8, 0.5, 0.3);
    scene_colour(&s, 40000, 65535, 0.4, 0.5, 1, 0.8);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.8, 0.5), 26, 45, 64);
    trip_settings settings = trip_settings_default();
    settings.background[3] = 0;
    assert_int_equal(trip_camera_make(&camera, &view, &s.data->index_to_world), 0);
    const trip_splat_frame f = trip_splat_frame_make(&camera, &settings);
    scene_picture expected = scene_draw(&s, &reference, &view, &settings);
    for (int target = TRIP_TARGET_RGBA32F; target <= TRIP_TARGET_RGBA8; target++) {
        settings.target = (trip_target)target;
        scene_picture p = scene_draw(&s, &gl, &view, &settings);
        double most = 0;
        unsigned max_n = 0;
        for (int y = 0; y < p.height; y++)
            for (int x = 0; x < p.width; x++) {
                const unsigned n = overlap_at(&f, x + 0.5, y + 0.5);
                max_n = n > max_n ? n : max_n;
                for (int c = 0; c < 4; c++) {
                    double off = fabs((double)scene_pixel(&p, x, y)[c] -
                                      (double)scene_pixel(&expected, x, y)[c]);
                    most = fmax(most, off);
                    assert_true(off <= 2 * n * steps[target] + scene_bound(&settings));
                }
            }
        print_message("%s, at most %u splats: most %.3f mean %.4f of 1/255\n", names[target], max_n,
                      255 * most, 255 * mean_difference(&expected, &p));
        assert_true((most > scene_bound(&settings)) ==
                    (target != TRIP_TARGET_RGBA32F)); /* it is used */
        scene_picture_free(&p);
    }
    scene_picture_free(&expected);
    scene_destroy(&s);
}

enum { PARTS_PX = 300 };

/* A renderer and the objects that its frames are drawn from. */
typedef struct bench {
    trip_budget *budget;
    trip_renderer *renderer;
    trip_reader *reader;
    trip_camera camera;
    trip_plan plan;
    trip_frame frame;
} bench;

static void set_up(bench *b, const scene *s, const trip_camera_params *view,
                   const trip_settings *settings)
{
    *b = (bench){ .budget = s->budget };
    assert_int_equal(trip_gl_create(&b->renderer, s->budget), 0);
    assert_int_equal(trip_camera_make(&b->camera, view, &s->data->index_to_world), 0);
    assert_int_equal(trip_plan_make(&b->plan, s->data, &b->camera, settings, s->table, s->budget),
                     0);
    trip_reader_params params = { .planes = b->plan.planes, .engine = TRIP_ENGINE_NULL };
    assert_int_equal(trip_reader_create(&b->reader, s->data, &params, s->budget), 0);
    b->frame = (trip_frame){ .data = s->data,
                             .camera = &b->camera,
                             .settings = settings,
                             .plan = &b->plan,
                             .table = s->table };
}

static void put_away(bench *b)
{
    trip_reader_destroy(b->reader);
    trip_plan_release(&b->plan, b->budget);
    b->renderer->ops->destroy(b->renderer);
}

/* Draws a frame in the shortest possible steps, at most `max`. Returns their number. Cancels a
 * frame that has not ended by then. */
static int draw_in_steps(bench *b, int max, float *rgba)
{
    trip_drawing drawing;
    int status = TRIP_FRAME_MORE, steps = 0;
    assert_int_equal(trip_frame_begin(&drawing, b->renderer, b->reader, &b->frame), 0);
    while (status > 0 && steps < max) {
        status = trip_frame_step(&drawing, 0);
        steps += status == TRIP_FRAME_MORE;
        if (status == TRIP_FRAME_WAITS)
            trip_frame_await(&drawing, UINT64_MAX);
    }
    assert_true(status >= 0);
    if (status == TRIP_FRAME_DONE)
        assert_int_equal(trip_frame_picture(&drawing, rgba, NULL), 0);
    trip_frame_end(&drawing);
    return steps;
}

/* Steps are as short for large splats as for small ones. */
static void a_step_draws_few_pixels(void **state)
{
    (void)state;
    static float rgba[4 * PARTS_PX * PARTS_PX];
    scene s;
    bench b;
    make_shells(&s, &cubes);
    trip_settings settings = trip_settings_default();
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.1, 0.2), 800, 40, PARTS_PX);
    set_up(&b, &s, &view, &settings);
    double splats = (double)trip_plan_splats(&b.plan);
    assert_true(splats > 10000);
    int steps = draw_in_steps(&b, INT_MAX, rgba);
    double piece = b.renderer->software ? TRIP_FRAME_PIECE / 4 : TRIP_FRAME_PIECE;
    assert_true(steps <= 3 + splats / piece); /* at most three layers */
    put_away(&b);

    /* A splat is 400 px wide, so that every splat covers a quarter of the image or more. */
    view.ortho_height = 3;
    set_up(&b, &s, &view, &settings);
    splats = (double)trip_plan_splats(&b.plan);
    assert_true(splats > 1000);
    steps = draw_in_steps(&b, INT_MAX, rgba);
    assert_true(steps >= splats * PARTS_PX * PARTS_PX / 4 / (1 << 21));
    put_away(&b);
    scene_picture whole = scene_draw(&s, &gl, &view, &settings);
    assert_memory_equal(rgba, whole.rgba, sizeof rgba);
    scene_picture_free(&whole);
    scene_destroy(&s);
}

static void indexed_lists_are_loaded_in_steps_and_once(void **state)
{
    (void)state;
    static float rgba[4 * PARTS_PX * PARTS_PX];
    scene s;
    bench b;
    make_shells(&s, &cubes);
    trip_settings settings = trip_settings_default();
    settings.indexed = true;
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.8, 0.7), 80, 40, PARTS_PX);
    scene_picture whole = scene_draw(&s, &gl, &view, &settings);
    set_up(&b, &s, &view, &settings);
    assert_true(s.data->header.kept > TRIP_FRAME_PIECE);
    uint64_t before = trip_budget_left_bytes(s.budget);
    for (int max = 1; max < 9; max += 2) /* no frame ends */
        assert_int_equal(draw_in_steps(&b, max, rgba), max);
    int first = draw_in_steps(&b, INT_MAX, rgba);
    assert_memory_equal(rgba, whole.rgba, sizeof rgba);
    int second = draw_in_steps(&b, INT_MAX, rgba);
    assert_memory_equal(rgba, whole.rgba, sizeof rgba);
    assert_true(second < first);
    assert_true(trip_budget_left_bytes(s.budget) < before);
    put_away(&b);
    scene_picture_free(&whole);
    scene_destroy(&s);
}

static bool one_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)code;
    (void)gradient;
    return i == 2 && j == 2 && k == 2;
}

/* A layer of more than 2^24 pixels consists of bands: here 2048 rows, and 12. */
static void a_splat_across_two_bands_of_a_layer_is_whole(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 5, 5, 5 }, .voxel = one_voxel });
    scene_colour(&s, 0, 65535, 1, 1, 1, 0.7);
    trip_settings settings = trip_settings_default();
    settings.shading = false;
    settings.background[3] = 0;
    trip_camera_params view = scene_view(&s, trip_v3(1, 0, 0), 40, 40, 64);
    view.width = 8192;
    view.height = 2060;
    view.ortho_height = 20.6; /* 100 px a voxel, and the voxel is at row 2046 */
    view.eye.z += 10.16;
    view.look.z += 10.16;
    trip_camera camera;
    trip_splat splat;
    assert_int_equal(trip_camera_make(&camera, &view, &s.data->index_to_world), 0);
    const trip_splat_frame f = trip_splat_frame_make(&camera, &settings);
    assert_true(trip_splat_project(&f, trip_v3(2, 2, 2), &splat));
    assert_true(fabs(splat.y - 2046) < 1e-6);
    scene_picture p = scene_draw(&s, &gl, &view, &settings);
    for (int y = 1840; y < p.height; y++) {
        for (int x = 3890; x < 4300; x++) {
            double m = trip_splat_radius2(&f, &splat, x + 0.5, y + 0.5), alpha = 0;
            if (m <= f.cutoff2)
                alpha = -expm1(-(double)s.table[0].extinction *
                               trip_splat_stretch(&f, x + 0.5, y + 0.5) * splat.amplitude *
                               (exp(-m / 2) - f.edge));
            assert_true(fabs((double)scene_pixel(&p, x, y)[3] - alpha) < 1e-5);
        }
    }
    scene_picture_free(&p);
    scene_destroy(&s);
}

static char last_line[512];
static int line_count;

static void keep_line(const char *line, void *user)
{
    (void)user;
    line_count++;
    snprintf(last_line, sizeof last_line, "%s", line);
}

/* Draws a frame and returns its status. A frame that fails must report once; last_line holds the
 * report. */
static int try_frame(const scene *s, trip_renderer *r, const trip_camera_params *view,
                     const trip_settings *settings)
{
    trip_camera camera;
    trip_plan plan;
    trip_reader *reader;
    trip_frame_stats stats;
    float *rgba = malloc((size_t)view->width * (size_t)view->height * 4 * sizeof *rgba);
    assert_int_equal(trip_camera_make(&camera, view, &s->data->index_to_world), 0);
    assert_int_equal(trip_plan_make(&plan, s->data, &camera, settings, s->table, s->budget), 0);
    assert_int_equal(trip_reader_create(&reader, s->data,
                                        &(trip_reader_params){ .planes = plan.planes }, s->budget),
                     0);
    trip_frame frame = {
        .data = s->data, .camera = &camera, .settings = settings, .plan = &plan, .table = s->table
    };
    line_count = 0;
    trip_report_redirect(keep_line, NULL);
    int status = trip_frame_draw(r, reader, &frame, rgba, NULL, &stats);
    trip_report_redirect(NULL, NULL);
    assert_int_equal(line_count, status ? 1 : 0);
    trip_reader_destroy(reader);
    trip_plan_release(&plan, s->budget);
    free(rgba);
    return status;
}

static void frames_that_do_not_fit_are_refused_and_the_next_draws(void **state)
{
    (void)state;
    scene s;
    trip_renderer *r;
    make_shells(&s, &cubes);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0, 0), 80, 40, 32), huge = view;
    trip_settings settings = trip_settings_default();
    assert_int_equal(trip_gl_create(&r, s.budget), 0);

    huge.width = 65536;
    huge.height = 1;
    assert_true(try_frame(&s, r, &huge, &settings) < 0);

    /* Most of the budget is taken. */
    size_t max = (size_t)trip_budget_left_bytes(s.budget) - (48u << 20);
    void *taken = trip_budget_take(s.budget, max);
    assert_non_null(taken);
    trip_camera_params wide = view;
    wide.width = wide.height = 2048;
    assert_true(try_frame(&s, r, &wide, &settings) < 0);
    trip_budget_release(s.budget, taken, max);

    assert_int_equal(try_frame(&s, r, &view, &settings), 0);
    r->ops->destroy(r);
    scene_destroy(&s);
}

static void copy_shaders(const char *folder)
{
    char command[512];
    snprintf(command, sizeof command, "cp %s/shaders/* '%s'", TRIP_SOURCE_DIR, folder);
    assert_int_equal(system(command), 0);
}

static void append_line(const char *folder, const char *name, const char *line)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "a");
    assert_non_null(file);
    fprintf(file, "%s\n", line);
    fclose(file);
}

/* Counts the lines of a shader file up to and including an appended line. */
static int count_lines(const char *folder, const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    int lines = 0, c;
    while ((c = fgetc(file)) != EOF)
        lines += c == '\n';
    fclose(file);
    return lines;
}

static void a_shader_that_does_not_compile_is_named_with_its_line(void **state)
{
    (void)state;
    scene s;
    trip_renderer *r;
    char folder[] = "/tmp/trip-shaders-XXXXXX", command[64], where[64];
    make_shells(&s, &cubes);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0, 0), 80, 40, 32);
    trip_settings settings = trip_settings_default();
    assert_non_null(mkdtemp(folder));
    copy_shaders(folder);
    setenv("TRIPTYCH_SHADER_DIR", folder, 1);

    assert_int_equal(trip_gl_create(&r, s.budget), 0);
    assert_int_equal(try_frame(&s, r, &view, &settings), 0); /* shaders read from disk */
    r->ops->destroy(r);

    append_line(folder, "project.glsl", "float broken = nothing;");
    snprintf(where, sizeof where, "project.glsl:%d: ", count_lines(folder, "project.glsl"));
    assert_int_equal(trip_gl_create(&r, s.budget), 0);
    assert_true(try_frame(&s, r, &view, &settings) < 0);
    assert_non_null(strstr(last_line, where));
    r->ops->destroy(r);

    unsetenv("TRIPTYCH_SHADER_DIR");
    snprintf(command, sizeof command, "rm -r '%s'", folder);
    assert_int_equal(system(command), 0);
    scene_destroy(&s);
}

static void a_missing_shader_is_reported(void **state)
{
    (void)state;
    scene s;
    trip_renderer *r;
    make_shells(&s, &cubes);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0, 0), 80, 40, 32);
    trip_settings settings = trip_settings_default();
    setenv("TRIPTYCH_SHADER_DIR", "/nonexistent", 1);
    assert_int_equal(trip_gl_create(&r, s.budget), 0);
    assert_true(try_frame(&s, r, &view, &settings) < 0);
    r->ops->destroy(r);
    unsetenv("TRIPTYCH_SHADER_DIR");
    scene_destroy(&s);
}

static void shaders_are_the_same_in_a_locale_with_decimal_commas(void **state)
{
    (void)state;
    scene s;
    make_shells(&s, &cubes);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.8, 0.5), 80, 40, 32);
    trip_settings settings = trip_settings_default();
    scene_picture expected = scene_draw(&s, &gl, &view, &settings);
    need_comma_locale();
    scene_picture got = scene_draw(&s, &gl, &view, &settings);
    setlocale(LC_ALL, "C");
    assert_memory_equal(got.rgba, expected.rgba, 32 * 32 * 4 * sizeof *got.rgba);
    scene_picture_free(&expected);
    scene_picture_free(&got);
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(submission_forms_give_the_same_picture_and_counts),
        cmocka_unit_test(two_points_cull_as_in_the_reference),
        cmocka_unit_test(without_culling_every_brick_is_read_and_the_picture_stays),
        cmocka_unit_test(every_method_and_traversal_agrees_with_the_reference),
        cmocka_unit_test(a_voxel_at_the_eye_is_lit_like_in_the_reference),
        cmocka_unit_test(grids_that_are_not_cubic_agree_with_the_reference),
        cmocka_unit_test(light_and_kernel_settings_agree_with_the_reference),
        cmocka_unit_test(supports_larger_than_sprites_are_drawn_as_triangles),
        cmocka_unit_test(splats_with_centres_out_of_view_are_drawn),
        cmocka_unit_test(the_size_of_batches_makes_no_difference),
        cmocka_unit_test(reads_into_gl_memory_give_the_same_picture_as_copies),
        cmocka_unit_test(targets_are_off_by_at_most_two_steps_a_splat),
        cmocka_unit_test(a_step_draws_few_pixels),
        cmocka_unit_test(indexed_lists_are_loaded_in_steps_and_once),
        cmocka_unit_test(a_splat_across_two_bands_of_a_layer_is_whole),
        cmocka_unit_test(frames_that_do_not_fit_are_refused_and_the_next_draws),
        cmocka_unit_test(a_shader_that_does_not_compile_is_named_with_its_line),
        cmocka_unit_test(a_missing_shader_is_reported),
        cmocka_unit_test(shaders_are_the_same_in_a_locale_with_decimal_commas),
    };
    if (!scene_has_gl())
        return 77;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
