#include "scenes.h"
#include "interrupt.h"
#include "test.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>

static void make_scene(scene *s)
{
    scene_create(s, &(scene_params){ .dims = { 40, 30, 20 }, .tile_voxels = 16, .normals = true });
    scene_colour(s, 0, 65535, 1, 0.8, 0.6, 0.2);
}

/* The signal to raise once the frame is planned; 0 for none. */
static int signal_when_planned;

/* Draws one frame with the given renderer and reader, and returns its status. */
static int draw(const scene *s, trip_renderer *r, trip_reader *reader,
                const trip_camera_params *view, float *rgba, trip_frame_stats *stats)
{
    trip_camera camera;
    trip_plan plan;
    trip_settings settings = trip_settings_default();
    settings.h = 0.2;
    assert_int_equal(trip_camera_make(&camera, view, &s->data->index_to_world), 0);
    assert_int_equal(trip_plan_make(&plan, s->data, &camera, &settings, s->table, s->budget), 0);
    if (signal_when_planned)
        raise(signal_when_planned);
    trip_frame frame = { .data = s->data,
                         .camera = &camera,
                         .settings = &settings,
                         .plan = &plan,
                         .table = s->table,
                         .count = true };
    int status = trip_frame_draw(r, reader, &frame, rgba, NULL, stats);
    trip_plan_release(&plan, s->budget);
    return status;
}

static trip_reader *make_reader(const scene *s, trip_reader_params params)
{
    trip_reader *reader;
    params.planes = 3;
    assert_int_equal(trip_reader_create(&reader, s->data, &params, s->budget), 0);
    return reader;
}

static void a_renderer_and_reader_serve_many_frames_of_any_size(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    for (const scene_renderer *kind = scene_renderers(); kind->name; kind++) {
        trip_renderer *r;
        assert_int_equal(kind->create(&r, s.budget), 0);
        trip_reader *reader = make_reader(&s, (trip_reader_params){ 0 });
        const int sizes[] = { 24, 40, 16, 40 };
        for (int i = 0; i < 4; i++) {
            trip_frame_stats stats;
            trip_camera_params view = scene_view(&s, trip_v3(1, 0.3 * i, 1), 80, 30, sizes[i]);
            size_t bytes = (size_t)(sizes[i] * sizes[i]) * 4 * sizeof(float);
            float *rgba = calloc(1, bytes);
            assert_non_null(rgba);
            assert_int_equal(draw(&s, r, reader, &view, rgba, &stats), 0);
            trip_settings settings = trip_settings_default();
            settings.h = 0.2;
            scene_picture fresh = scene_draw(&s, kind, &view, &settings);
            assert_memory_equal(rgba, fresh.rgba, bytes);
            scene_picture_free(&fresh);
            free(rgba);
        }
        trip_reader_destroy(reader);
        r->ops->destroy(r);
    }
    scene_destroy(&s);
}

static void bytes_and_splats_are_counted_for_each_list(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_camera_params view = scene_view(&s, trip_v3(0, 0, 1), 200, 20, 16);
    trip_settings settings = trip_settings_default();
    for (const scene_renderer *kind = scene_renderers(); kind->name; kind++) {
        scene_picture p = scene_draw(&s, kind, &view, &settings);
        const trip_list_stats *z = &p.lists[2];
        assert_int_equal(z->splats_read, 40 * 30 * 20);
        assert_int_equal(z->splats_projected, 40 * 30 * 20);
        assert_int_equal(z->splats_drawn, 40 * 30 * 20);
        assert_true(z->bytes_read >= 40 * 30 * 20 * 4 + 40 * 30 * 20 / 8); /* normals and masks */
        assert_int_equal(p.lists[0].splats_read + p.lists[1].splats_read, 0);
        assert_int_equal(p.lists[0].bytes_read + p.lists[1].bytes_read, 0);
        assert_int_equal(p.stats.reader.bytes_read, z->bytes_read);
        assert_true(p.stats.ms > 0 && p.stats.ms >= p.stats.draw_ms);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

static void keep_progress(void *user, const char *stage, uint64_t splats, uint64_t total)
{
    uint64_t *last = user;
    assert_string_equal(stage, "splat");
    assert_true(splats > last[0] && splats <= total);
    last[0] = splats;
    last[1] = total;
}

static void progress_rises_to_the_number_of_splats(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_renderer *r;
    trip_camera camera;
    trip_plan plan;
    trip_frame_stats stats;
    float rgba[16 * 16 * 4];
    uint64_t last[2] = { 0 };
    trip_settings settings = trip_settings_default();
    trip_camera_params view = scene_view(&s, trip_v3(1, 2, 1), 80, 30, 16);
    assert_int_equal(trip_reference_create(&r, s.budget), 0);
    trip_reader *reader = make_reader(&s, (trip_reader_params){ .slots = 2, .slot_bytes = 4096 });
    assert_int_equal(trip_camera_make(&camera, &view, &s.data->index_to_world), 0);
    assert_int_equal(trip_plan_make(&plan, s.data, &camera, &settings, s.table, s.budget), 0);
    trip_frame frame = { .data = s.data,
                         .camera = &camera,
                         .settings = &settings,
                         .plan = &plan,
                         .table = s.table,
                         .progress = keep_progress,
                         .progress_user = last };
    assert_int_equal(trip_frame_draw(r, reader, &frame, rgba, NULL, &stats), 0);
    assert_true(last[0] > 0);
    assert_int_equal(last[0], last[1]);
    trip_plan_release(&plan, s.budget);
    trip_reader_destroy(reader);
    r->ops->destroy(r);
    scene_destroy(&s);
}

static long fail_reading(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    (void)user;
    (void)data;
    (void)offset;
    (void)bytes;
    (void)result;
    return -EIO;
}

static long flip_a_bit(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    (void)user;
    (void)offset;
    (void)bytes;
    ((unsigned char *)data)[result / 2] ^= 16;
    return result;
}

static void a_failed_or_damaged_read_ends_the_frame_with_one_report(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_camera_params view = scene_view(&s, trip_v3(1, 2, 1), 80, 30, 16);
    long (*const faults[])(void *, void *, uint64_t, size_t, long) = { fail_reading, flip_a_bit };
    static const char *const why[] = { "cannot read: Input/output error", "is damaged (checksum)" };
    for (int i = 0; i < 2; i++) {
        trip_renderer *r;
        trip_frame_stats stats;
        float rgba[16 * 16 * 4];
        assert_int_equal(trip_reference_create(&r, s.budget), 0);
        trip_reader *reader = make_reader(&s, (trip_reader_params){ .fault = faults[i] });
        test_catch_reports();
        assert_true(draw(&s, r, reader, &view, rgba, &stats) < 0);
        assert_one_report(why[i]);
        trip_reader_destroy(reader);
        r->ops->destroy(r);
    }
    scene_destroy(&s);
}

static void the_reference_reports_missing_memory_for_its_pixels(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_renderer *r;
    trip_frame_stats stats;
    float rgba[4];
    trip_camera_params view = scene_view(&s, trip_v3(1, 2, 1), 80, 30, 8000);
    assert_int_equal(trip_reference_create(&r, s.budget), 0);
    trip_reader *reader = make_reader(&s, (trip_reader_params){ 0 });
    test_catch_reports();
    assert_int_equal(draw(&s, r, reader, &view, rgba, &stats), TRIP_ERROR);
    assert_one_report("bytes of pixels do not fit the memory given; raise --memory");
    trip_reader_destroy(reader);
    r->ops->destroy(r);
    scene_destroy(&s);
}

/* A renderer that finishes a batch only when the frame waits for it. Before that, it checks that
 * the batch is unchanged. */
typedef struct lazy {
    trip_renderer base;
    unsigned max, drawn, done; /* batches: maximum held, drawn, finished */
    unsigned fail_at;          /* number of the draw that fails; 0 for none */
    bool awaited;              /* set if a wait occurred since the last batch was finished */
    uint32_t sums[64];         /* checksums of batches, by their number modulo 64 */
} lazy;

static uint32_t sum_of(const trip_batch *batch)
{
    uint32_t sum = (uint32_t)batch->run_count;
    for (size_t i = 0; i < batch->run_count; i++)
        for (uint32_t k = 0; k < batch->runs[i].count; k++) {
            const trip_block b = trip_block_of(batch, &batch->runs[i]);
            uint32_t voxel, normal;
            trip_block_voxels(&b, k, 1, &voxel);
            trip_block_normals(&b, k, 1, &normal);
            sum = sum * 31 + voxel + 7 * normal;
        }
    return sum;
}

static int lazy_begin_frame(trip_renderer *r, const trip_frame *frame)
{
    (void)frame;
    ((lazy *)r)->drawn = ((lazy *)r)->done = 0;
    return 0;
}

static int lazy_begin_layer(trip_renderer *r, int axis)
{
    (void)r;
    (void)axis;
    return 0;
}

static int lazy_draw(trip_renderer *r, const trip_batch *batch, bool front_to_back)
{
    lazy *l = (lazy *)r;
    (void)front_to_back;
    l->sums[l->drawn++ % 64] = sum_of(batch);
    assert_true(l->drawn - l->done <= l->max + 1);
    return l->drawn == l->fail_at ? trip_fail(TRIP_ERROR, "test", "draw", "fails") : 0;
}

/* Reports only the batches that were waited for. */
static int lazy_is_done(trip_renderer *r, const trip_batch *batch)
{
    lazy *l = (lazy *)r;
    if (!l->awaited)
        return 0;
    l->awaited = false;
    assert_int_equal(l->sums[l->done++ % 64], sum_of(batch));
    return 1;
}

static void lazy_await(trip_renderer *r, uint64_t timeout_ns)
{
    (void)timeout_ns;
    ((lazy *)r)->awaited = true;
}

static int lazy_picture(trip_renderer *r, float *rgba, float *depth)
{
    (void)r;
    (void)rgba;
    (void)depth;
    return 0;
}

static trip_list_stats lazy_stats(const trip_renderer *r, unsigned list)
{
    (void)r;
    (void)list;
    return (trip_list_stats){ 0 };
}

static const trip_renderer_ops lazy_ops = {
    .name = "lazy",
    .begin_frame = lazy_begin_frame,
    .begin_layer = lazy_begin_layer,
    .draw = lazy_draw,
    .is_done = lazy_is_done,
    .await = lazy_await,
    .picture = lazy_picture,
    .stats = lazy_stats,
};

static void batches_stay_unchanged_until_the_renderer_has_finished_them(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_frame_stats stats;
    float rgba[16 * 16 * 4] = { 0 }; /* the lazy renderer draws nothing */
    trip_camera_params view = scene_view(&s, trip_v3(1, 2, 1), 80, 30, 16);
    const unsigned slots[] = { 2, 3, 8, 64 }, held[] = { 1, 1, 4, 15 };
    for (int i = 0; i < 4; i++) {
        lazy l = { .base = { .ops = &lazy_ops }, .max = held[i] };
        trip_reader *reader =
            make_reader(&s, (trip_reader_params){ .slots = slots[i], .slot_bytes = 16384 });
        assert_int_equal(draw(&s, &l.base, reader, &view, rgba, &stats), 0);
        assert_int_equal(l.drawn - l.done, l.drawn < held[i] ? l.drawn : held[i]);
        uint64_t splats = stats.reader.splats;
        assert_true(l.drawn > 1 && splats > 0);
        l.fail_at = l.drawn / 2 + 1; /* a cancelled frame leaves no slot behind */
        test_catch_reports();
        assert_int_equal(draw(&s, &l.base, reader, &view, rgba, &stats), TRIP_ERROR);
        assert_one_report("test: draw: fails");
        l.fail_at = 0;
        assert_int_equal(draw(&s, &l.base, reader, &view, rgba, &stats), 0);
        assert_int_equal(stats.reader.splats, splats);
        trip_reader_destroy(reader);
    }
    scene_destroy(&s);
}

/* This test runs last because nothing clears the signal. */
static void plan_is_interrupted(const scene *s, const trip_camera_params *view)
{
    trip_camera camera;
    trip_plan plan;
    trip_settings settings = trip_settings_default();
    assert_int_equal(trip_camera_make(&camera, view, &s->data->index_to_world), 0);
    trip_interrupt_install();
    raise(SIGINT);
    test_catch_reports();
    assert_int_equal(trip_plan_make(&plan, s->data, &camera, &settings, s->table, s->budget),
                     TRIP_INTERRUPTED);
    assert_one_report("plan: interrupted");
}

static void an_interrupt_ends_plan_and_frame(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    trip_renderer *r;
    trip_frame_stats stats;
    float rgba[16 * 16 * 4];
    trip_camera_params view = scene_view(&s, trip_v3(1, 2, 1), 80, 30, 16);
    assert_int_equal(trip_reference_create(&r, s.budget), 0);
    trip_reader *reader = make_reader(&s, (trip_reader_params){ 0 });
    trip_interrupt_install();
    signal_when_planned = SIGINT;
    test_catch_reports();
    assert_int_equal(draw(&s, r, reader, &view, rgba, &stats), TRIP_INTERRUPTED);
    assert_one_report("frame: interrupted");
    signal_when_planned = 0;
    plan_is_interrupted(&s, &view);
    trip_reader_destroy(reader);
    r->ops->destroy(r);
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_renderer_and_reader_serve_many_frames_of_any_size),
        cmocka_unit_test(bytes_and_splats_are_counted_for_each_list),
        cmocka_unit_test(progress_rises_to_the_number_of_splats),
        cmocka_unit_test(a_failed_or_damaged_read_ends_the_frame_with_one_report),
        cmocka_unit_test(the_reference_reports_missing_memory_for_its_pixels),
        cmocka_unit_test(batches_stay_unchanged_until_the_renderer_has_finished_them),
        cmocka_unit_test(an_interrupt_ends_plan_and_frame),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
