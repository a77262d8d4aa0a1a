/* The CPU renderer's picture must have the same bits for any number of threads, memory size, tile
 * size and batch size, with and without occlusion culling. */
#include "cpu/kernels/isa.h"
#include "cpu/cpu_renderer.h"
#include "cpu_scenes.h"
#include "test.h"

#include <stdlib.h>
#include <string.h>

static trip_camera_params side_view(const scene *s)
{
    return scene_view(s, trip_v3(1, 0.7, 0.5), 48, 50, 110);
}

/* Returns a wide view from inside. The rays of a list go in both directions, in separate panes and
 * within one pane. */
static trip_camera_params inside_view(const scene *s)
{
    return scene_view(s, trip_v3(0.3, -0.6, 0.5), 5, 150, 70);
}

static void assert_same(const scene_picture *a, const scene_picture *b)
{
    assert_int_equal(a->width, b->width);
    assert_memory_equal(a->rgba, b->rgba, 16 * (size_t)a->width * (size_t)a->height);
}

static trip_settings settings_with(trip_compositing compositing, trip_footprint footprint)
{
    trip_settings s = trip_settings_default();
    s.compositing = compositing;
    s.footprint = footprint;
    s.flatten = footprint == TRIP_FOOTPRINT_EWA ? 3 : 1;
    return s;
}

/* Compares two pictures with every instruction set and target, and by sheets. The first draws `a`
 * with one thread. The second draws `b` with several threads, from batches given by `reader`. */
static void check_view(const scene *a, const scene *b, trip_camera_params view, unsigned threads,
                       const trip_reader_params *reader)
{
    enum { TARGETS = TRIP_TARGET_RGBA8 + 1, FORMS }; /* the last form composites by sheets */
    static int turn;                                 /* the form, if forms take turns */
    trip_settings settings = settings_with(
        TRIP_COMPOSITING_SPLAT, turn % 3 == 1 ? TRIP_FOOTPRINT_EWA : TRIP_FOOTPRINT_EXACT);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        for (int form = 0; form < FORMS; form++) {
            if (TEST_BY_TURNS && form != turn % FORMS)
                continue;
            settings.target = (trip_target)(form % TARGETS);
            settings.compositing = (trip_compositing)(form / TARGETS);
            settings.early_termination = turn % 2 ? 0.04 : TRIP_EARLY_TERMINATION_AUTO;
            cpu_scenes_threads = 1;
            scene_picture p = scene_draw(a, &cpu_scenes_cpu, &view, &settings);
            cpu_scenes_threads = threads;
            scene_picture q = scene_draw_with(b, &cpu_scenes_cpu, &view, &settings, reader);
            assert_same(&p, &q);
            scene_picture_free(&p);
            scene_picture_free(&q);
        }
    }
    turn++;
    unsetenv("TRIPTYCH_ISA");
}

static void check_same(const scene *a, const scene *b, unsigned threads,
                       const trip_reader_params *reader)
{
    check_view(a, b, side_view(a), threads, reader);
    check_view(a, b, inside_view(a), threads, reader);
}

static void any_number_of_threads_draws_the_same(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 32, NULL);
    const unsigned threads[] = { 2, 3, 5, 8 };
    for (int i = 0; i < 4; i++)
        check_same(&s, &s, threads[i], &(trip_reader_params){ 0 });
    scene_destroy(&s);
}

static void any_size_of_batch_draws_the_same(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 32, NULL);
    for (unsigned slots = 2; slots <= 64; slots *= 4)
        check_same(&s, &s, 3, &(trip_reader_params){ .slots = slots, .slot_bytes = 4096 });
    scene_destroy(&s);
}

static void any_tile_of_the_data_draws_the_same(void **state)
{
    (void)state;
    scene first;
    cpu_scenes_blobs(&first, 16, NULL);
    for (unsigned tile = 32; tile <= 128; tile *= 2) {
        scene s;
        cpu_scenes_blobs(&s, tile, NULL);
        check_same(&first, &s, 4, &(trip_reader_params){ 0 });
        scene_destroy(&s);
    }
    scene_destroy(&first);
}

/* The memory limits the size of a flush. Here a flush holds 8192 splats, a fraction of the scene.
 */
static void little_memory_draws_the_same(void **state)
{
    (void)state;
    scene s, small;
    cpu_scenes_blobs(&s, 32, NULL);
    small = s;
    assert_int_equal(trip_budget_create(&small.budget, UINT64_C(6) << 20), 0);
    check_same(&s, &small, 4, &(trip_reader_params){ .slots = 4, .slot_bytes = 4096 });
    trip_budget_destroy(small.budget);
    scene_destroy(&s);
}

/* The scene lies in one pane of the picture. Threads share the pane by quarters. */
static void a_scene_in_one_pane_draws_the_same(void **state)
{
    (void)state;
    scene s, small;
    cpu_scenes_blobs(&s, 32, NULL);
    small = s;
    assert_int_equal(trip_budget_create(&small.budget, UINT64_C(6) << 20), 0);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.7, 0.5), 300, 50, 160);
    for (unsigned threads = 3; threads <= 7; threads += 2)
        check_view(&s, &small, view, threads,
                   &(trip_reader_params){ .slots = 4, .slot_bytes = 4096 });
    trip_budget_destroy(small.budget);
    scene_destroy(&s);
}

typedef struct frame_by_hand {
    trip_camera camera;
    trip_settings settings;
    trip_plan plan;
    trip_frame frame;
    trip_renderer *renderer;
    float *rgba;
    uint64_t splats, occluded;
} frame_by_hand;

static void begin_by_hand(frame_by_hand *f, const scene *s, const trip_camera_params *view,
                          unsigned threads, const trip_settings *settings)
{
    f->settings = *settings;
    f->splats = f->occluded = 0;
    assert_int_equal(trip_camera_make(&f->camera, view, &s->data->index_to_world), 0);
    assert_int_equal(
        trip_plan_make(&f->plan, s->data, &f->camera, &f->settings, s->table, s->budget), 0);
    assert_int_equal(trip_cpu_create(&f->renderer, s->budget, threads), 0);
    f->frame = (trip_frame){ .data = s->data,
                             .camera = &f->camera,
                             .settings = &f->settings,
                             .plan = &f->plan,
                             .table = s->table };
    f->rgba = calloc(4 * (size_t)view->width * (size_t)view->height, sizeof *f->rgba);
    assert_non_null(f->rgba);
    assert_int_equal(f->renderer->ops->begin_frame(f->renderer, &f->frame), 0);
}

static void end_by_hand(frame_by_hand *f, const scene *s)
{
    f->renderer->ops->destroy(f->renderer);
    trip_plan_release(&f->plan, s->budget);
    free(f->rgba);
}

/* Draws a batch in pieces of at most `piece` runs, without occluded bricks. */
static void draw_pieces(frame_by_hand *f, const trip_batch *batch, size_t piece, bool skip)
{
    for (size_t i = 0, n; i < batch->run_count; i += n) {
        trip_batch some = *batch;
        some.runs = &batch->runs[i];
        for (n = 0; n < piece && i + n < batch->run_count; n++)
            f->splats += some.runs[n].count;
        some.run_count = n;
        if (skip && trip_cpu_occluded(f->renderer, batch->pass->selections, some.runs)) {
            f->occluded += some.runs->count;
            continue;
        }
        assert_int_equal(f->renderer->ops->draw(f->renderer, &some, true), 0);
    }
}

static void draw_by_hand(frame_by_hand *f, const scene *s, size_t piece, bool skip)
{
    trip_reader *reader;
    trip_batch batch;
    assert_int_equal(trip_reader_create(&reader, s->data,
                                        &(trip_reader_params){ .planes = f->plan.planes },
                                        s->budget),
                     0);
    for (int axis = 0; axis < 3; axis++) {
        if (f->plan.layers[axis].pass_count == 0)
            continue;
        assert_int_equal(f->renderer->ops->begin_layer(f->renderer, axis), 0);
        for (int i = 0; i < f->plan.layers[axis].pass_count; i++) {
            const trip_pass pass = f->plan.layers[axis].passes[i].pass;
            assert_int_equal(trip_reader_begin(reader, &pass), 0);
            while (trip_reader_next(reader, &batch) > 0) {
                draw_pieces(f, &batch, piece, skip);
                trip_reader_release(reader, &batch);
            }
        }
    }
    assert_int_equal(f->renderer->ops->picture(f->renderer, f->rgba, NULL), 0);
    f->renderer->ops->end_frame(f->renderer);
    trip_reader_destroy(reader);
}

static void check_pieces(trip_settings settings, bool inside)
{
    scene s;
    cpu_scenes_blobs(&s, 32, NULL);
    trip_camera_params view = inside ? inside_view(&s) : side_view(&s);
    scene_picture whole = scene_draw(&s, &cpu_scenes_cpu, &view, &settings);
    const size_t pieces[3] = { 1, 3, 17 };
    for (int i = 0; i < 3; i++) {
        frame_by_hand f;
        begin_by_hand(&f, &s, &view, 3, &settings);
        assert_int_equal(f.plan.layers[0].parted, inside);
        draw_by_hand(&f, &s, pieces[i], false);
        assert_memory_equal(f.rgba, whole.rgba, 16 * (size_t)view.width * (size_t)view.height);
        end_by_hand(&f, &s);
    }
    scene_picture_free(&whole);
    scene_destroy(&s);
}

static void batches_cut_anywhere_draw_the_same(void **state)
{
    (void)state;
    for (int inside = 0; inside < 2; inside++) {
        check_pieces(settings_with(TRIP_COMPOSITING_SPLAT, TRIP_FOOTPRINT_EXACT), inside);
        check_pieces(settings_with(TRIP_COMPOSITING_SHEET, TRIP_FOOTPRINT_EXACT), inside);
        check_pieces(settings_with(TRIP_COMPOSITING_SPLAT, TRIP_FOOTPRINT_EWA), inside);
    }
}

static bool solid(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)i;
    (void)j;
    (void)k;
    (void)gradient;
    *code = (unsigned)(i * 1000 + j * 300 + k);
    return true;
}

/* Draws a body of opaque voxels that fills the view. Voxels behind its front face are occluded. If
 * the eye is inside, voxels some radii away are occluded. */
static void check_occluded(trip_settings settings, bool inside)
{
    scene s;
    frame_by_hand all, some;
    settings.kernel_radius = inside ? 1 : settings.kernel_radius;
    scene_create(&s,
                 &(scene_params){
                     .dims = { 48, 48, 48 }, .tile_voxels = 16, .slab_sheets = 4, .voxel = solid });
    scene_colour(&s, 0, 65535, 0.4, 0.7, 0.2, 0.95);
    scene_colour(&s, 0, 20000, 0.9, 0.3, 0.2, 0.9);
    trip_camera_params view =
        inside ? inside_view(&s) : scene_view(&s, trip_v3(1, 0.5, 0.3), 70, 30, 100);
    begin_by_hand(&all, &s, &view, 1, &settings);
    draw_by_hand(&all, &s, UINT32_MAX / 2, false);
    /* Small buffers let panes close early. */
    for (unsigned threads = 1; threads <= 4; threads++) {
        trip_budget *budget = s.budget;
        assert_int_equal(trip_budget_create(&s.budget, (uint64_t)(inside ? 16 : 64) << 20), 0);
        begin_by_hand(&some, &s, &view, threads, &settings);
        draw_by_hand(&some, &s, 1, true);
        assert_memory_equal(all.rgba, some.rgba, 16 * (size_t)view.width * (size_t)view.height);
        if (threads == 1)
            print_message("%llu of %llu splats left out\n", (unsigned long long)some.occluded,
                          (unsigned long long)some.splats);
        assert_true(some.occluded > 0);
        end_by_hand(&some, &s);
        trip_budget_destroy(s.budget);
        s.budget = budget;
    }
    end_by_hand(&all, &s);
    scene_destroy(&s);
}

static void occlusion_culling_draws_the_same(void **state)
{
    (void)state;
    for (int inside = 0; inside < 2; inside++) {
        check_occluded(settings_with(TRIP_COMPOSITING_SPLAT, TRIP_FOOTPRINT_EXACT), inside);
        check_occluded(settings_with(TRIP_COMPOSITING_SHEET, TRIP_FOOTPRINT_EXACT), inside);
        check_occluded(settings_with(TRIP_COMPOSITING_SPLAT, TRIP_FOOTPRINT_EWA), inside);
    }
}

static void frames_follow_one_another_on_one_renderer(void **state)
{
    (void)state;
    scene s;
    frame_by_hand f;
    cpu_scenes_blobs(&s, 32, NULL);
    trip_settings settings = trip_settings_default();
    trip_camera_params view = side_view(&s);
    scene_picture alone = scene_draw(&s, &cpu_scenes_cpu, &view, &settings);
    begin_by_hand(&f, &s, &view, 3, &settings);
    draw_by_hand(&f, &s, 5000, false);
    /* A frame cancelled half-way, with splats still in the buffers, leaves nothing behind. */
    assert_int_equal(f.renderer->ops->begin_frame(f.renderer, &f.frame), 0);
    assert_int_equal(f.renderer->ops->begin_layer(f.renderer, 1), 0);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(f.renderer->ops->begin_frame(f.renderer, &f.frame), 0);
        memset(f.rgba, 0, 16 * (size_t)view.width * (size_t)view.height);
        draw_by_hand(&f, &s, 5000, false);
        assert_memory_equal(f.rgba, alone.rgba, 16 * (size_t)view.width * (size_t)view.height);
    }
    end_by_hand(&f, &s);
    scene_picture_free(&alone);
    scene_destroy(&s);
}

/* The threads of a frame also compute the sweeps of light. */
static void light_has_the_same_bits_with_any_number_of_threads(void **state)
{
    (void)state;
    scene s;
    cpu_scenes_blobs(&s, 32, NULL);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.7, 0.5), 48, 50, 32);
    trip_settings settings = trip_settings_default();
    settings.headlight = false;
    settings.light_direction = trip_normalize(trip_v3(0.2, -0.5, 1));
    settings.effects.shadows = settings.effects.occlusion = true;
    settings.effects.cells = 24;
    cpu_scenes_threads = 1;
    scene_picture p = scene_draw(&s, &cpu_scenes_cpu, &view, &settings);
    cpu_scenes_threads = 4;
    scene_picture q = scene_draw(&s, &cpu_scenes_cpu, &view, &settings);
    settings.effects.occlusion = false;
    scene_picture without = scene_draw(&s, &cpu_scenes_cpu, &view, &settings);
    assert_same(&p, &q);
    assert_true(scene_difference(&p, &without) > 0.01);
    scene_picture_free(&p);
    scene_picture_free(&q);
    scene_picture_free(&without);
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_number_of_threads_draws_the_same),
        cmocka_unit_test(any_size_of_batch_draws_the_same),
        cmocka_unit_test(any_tile_of_the_data_draws_the_same),
        cmocka_unit_test(little_memory_draws_the_same),
        cmocka_unit_test(a_scene_in_one_pane_draws_the_same),
        cmocka_unit_test(batches_cut_anywhere_draw_the_same),
        cmocka_unit_test(occlusion_culling_draws_the_same),
        cmocka_unit_test(frames_follow_one_another_on_one_renderer),
        cmocka_unit_test(light_has_the_same_bits_with_any_number_of_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
