/* Tests of frames drawn in steps, which are inspected, cancelled, and drawn side by side. */
#include "clock.h"
#include "desk.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Every component must be in range, and no pixel may be more opaque than early termination allows.
 */
static void check_range(const float *rgba)
{
    for (int i = 0; i < 4 * PIXELS; i++)
        assert_true(rgba[i] >= 0 && rgba[i] <= 1.00001f);
}

/* The opacity of a pixel must never decrease. */
static void check_growth(const float *before, const float *after)
{
    for (int i = 0; i < PIXELS; i++)
        assert_true(after[4 * i + 3] >= before[4 * i + 3] - 1e-5f);
}

static void step_by_step(desk *d, bool look, float *rgba, int *steps)
{
    trip_drawing drawing;
    static float before[4 * PIXELS];
    memset(before, 0, sizeof before);
    int status = trip_frame_begin(&drawing, d->renderer, d->reader, &d->frame);
    assert_int_equal(status, 0);
    while ((status = trip_frame_step(&drawing, 0)) > 0) {
        ++*steps;
        if (status == TRIP_FRAME_WAITS)
            trip_frame_await(&drawing, UINT64_MAX);
        if (!look)
            continue;
        assert_int_equal(trip_frame_picture(&drawing, rgba, NULL), 0);
        check_range(rgba);
        check_growth(before, rgba);
        memcpy(before, rgba, sizeof before);
    }
    assert_int_equal(status, TRIP_FRAME_DONE);
    assert_int_equal(trip_frame_step(&drawing, 0), TRIP_FRAME_DONE);
    assert_int_equal(trip_frame_picture(&drawing, rgba, NULL), 0);
    trip_frame_end(&drawing);
}

static void take_steps(const scene *s, const scene_renderer *kind, trip_classify classify)
{
    static float whole[4 * PIXELS], stepped[4 * PIXELS];
    desk d;
    int steps = 0;
    set_up_to(&d, s, kind, small_slots, classify);
    for (int axis = 0; axis < 3; axis++)
        assert_true(d.plan.layers[axis].pass_count > 0);
    draw_whole(&d, whole);
    check_range(whole);
    step_by_step(&d, false, stepped, &steps);
    assert_true(steps > 10);
    assert_memory_equal(whole, stepped, sizeof whole);
    step_by_step(&d, true, stepped, &steps);
    assert_memory_equal(whole, stepped, sizeof whole);
    put_away(&d);
}

/* Values with different differences to the two sides. */
static bool waves(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    gradient[0] = sin(0.8 * i);
    gradient[1] = 0.02 * k;
    *code = (unsigned)(33000 + 32000 * sin(0.8 * i) * cos(0.7 * j - 0.9 * k));
    return true;
}

/* In `post`, values are lit. Their gradients depend on the sheets decoded at the time of
 * inspection. */
static void steps_and_inspections_leave_the_picture_the_same(void **state)
{
    (void)state;
    scene s;
    scene_create(&s,
                 &(scene_params){
                     .dims = { 40, 30, 20 }, .tile_voxels = 16, .normals = true, .voxel = waves });
    scene_colour(&s, 0, 65535, 1, 0.8, 0.6, 0.02);
    for (const scene_renderer *kind = scene_renderers(); kind->name; kind++)
        take_steps(&s, kind, TRIP_CLASSIFY_PRE);
    for (const scene_renderer *kind = scene_renderers_post(); kind->name; kind++)
        if (!TEST_BY_TURNS || strcmp(kind->name, "reference"))
            take_steps(&s, kind, TRIP_CLASSIFY_POST);
    scene_destroy(&s);
}

static void a_batch_is_drawn_in_pieces_when_there_is_a_deadline(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    for (const scene_renderer *kind = scene_renderers(); kind->name; kind++) {
        trip_drawing drawing;
        desk d;
        int steps = 0, status;
        set_up(&d, &s, kind, (trip_reader_params){ .engine = TRIP_ENGINE_NULL });
        assert_int_equal(trip_frame_begin(&drawing, d.renderer, d.reader, &d.frame), 0);
        while ((status = trip_frame_step(&drawing, 0)) > 0) {
            /* Reads have ended: the frame waits for the graphics device alone. */
            assert_true(status == TRIP_FRAME_MORE || d.renderer->ops->await);
            if (status == TRIP_FRAME_WAITS)
                trip_frame_await(&drawing, UINT64_MAX);
            steps += status == TRIP_FRAME_MORE;
        }
        /* A layer has 24000 splats, which fit into one batch. A software GL draws pieces of 4096.
         */
        assert_int_equal(steps, d.renderer->software ? 18 : 6);
        trip_frame_end(&drawing);
        put_away(&d);
    }
    scene_destroy(&s);
}

/* Reads wait at this gate until it opens, except for the first few. A gate that stays closed opens
 * by itself after GATE_SECONDS and records a failure. */
typedef struct gate {
    pthread_mutex_t lock;
    pthread_cond_t opened;
    bool open, failed;
    unsigned times_opened, free, waiting;
} gate;

enum { GATE_SECONDS = 20 };

static gate closed_gate(void)
{
    return (gate){ PTHREAD_MUTEX_INITIALIZER, PTHREAD_COND_INITIALIZER, .open = false };
}

static void wait_at(gate *g)
{
    struct timespec until;
    clock_gettime(CLOCK_REALTIME, &until);
    until.tv_sec += GATE_SECONDS;
    g->waiting++;
    for (unsigned before = g->times_opened; g->times_opened == before && !g->failed;)
        g->failed = pthread_cond_timedwait(&g->opened, &g->lock, &until) != 0;
}

static long pass_gate(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    gate *g = user;
    (void)data;
    (void)offset;
    (void)bytes;
    pthread_mutex_lock(&g->lock);
    if (!g->open && g->free == 0)
        wait_at(g);
    g->free -= g->free > 0;
    pthread_mutex_unlock(&g->lock);
    return result;
}

static void open_gate(gate *g)
{
    pthread_mutex_lock(&g->lock);
    g->open = true;
    g->times_opened++;
    pthread_cond_broadcast(&g->opened);
    pthread_mutex_unlock(&g->lock);
}

static void a_step_does_not_wait_for_the_disk(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    for (const scene_renderer *kind = scene_renderers(); kind->name; kind++) {
        static float rgba[4 * PIXELS], whole[4 * PIXELS];
        gate g = closed_gate();
        trip_drawing drawing;
        desk d;
        int status;
        set_up(&d, &s, kind, (trip_reader_params){ .fault = pass_gate, .fault_user = &g });
        d.settings.background[3] = 0;
        assert_int_equal(trip_frame_begin(&drawing, d.renderer, d.reader, &d.frame), 0);
        for (int i = 0; i < 3; i++) {
            assert_int_equal(trip_frame_step(&drawing, UINT64_MAX), TRIP_FRAME_WAITS);
            trip_frame_await(&drawing, 1000);
            assert_int_equal(trip_frame_picture(&drawing, rgba, NULL), 0);
        }
        for (int i = 0; i < 4 * PIXELS; i++)
            assert_true(rgba[i] == 0);
        open_gate(&g);
        while ((status = trip_frame_step(&drawing, UINT64_MAX)) == TRIP_FRAME_WAITS)
            trip_frame_await(&drawing, UINT64_MAX);
        assert_int_equal(status, TRIP_FRAME_DONE);
        assert_int_equal(trip_frame_picture(&drawing, rgba, NULL), 0);
        trip_frame_end(&drawing);
        draw_whole(&d, whole);
        assert_memory_equal(rgba, whole, sizeof whole);
        put_away(&d);
    }
    scene_destroy(&s);
}

/* The read is so slow that no frame ends within 10 ms. */
static long read_slowly(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    (void)user;
    (void)data;
    (void)offset;
    (void)bytes;
    nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
    return result;
}

static void a_frame_cancelled_during_reads_leaves_the_next_one_unchanged(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    for (const scene_renderer *kind = scene_renderers(); kind->name; kind++) {
        static float whole[4 * PIXELS], after[4 * PIXELS];
        trip_reader_params slow = small_slots;
        desk d;
        set_up(&d, &s, kind, small_slots);
        draw_whole(&d, whole);
        put_away(&d);
        slow.fault = read_slowly;
        slow.engine = TRIP_ENGINE_PREAD;
        slow.threads = 1;
        set_up(&d, &s, kind, slow);
        for (int round = 0; round < 3; round++) {
            trip_drawing drawing;
            assert_int_equal(trip_frame_begin(&drawing, d.renderer, d.reader, &d.frame), 0);
            for (uint64_t end = trip_now_ns() + 10000000; trip_now_ns() < end;)
                if (trip_frame_step(&drawing, end) == TRIP_FRAME_WAITS)
                    trip_frame_await(&drawing, 1000000);
            assert_false(drawing.done);
            if (round == 1)
                assert_int_equal(trip_frame_picture(&drawing, after, NULL), 0);
            trip_frame_end(&drawing);
        }
        draw_whole(&d, after);
        assert_memory_equal(whole, after, sizeof whole);
        put_away(&d);
    }
    scene_destroy(&s);
}

static bool uring_works(const scene *s)
{
    trip_reader *r;
    test_catch_reports();
    int status = trip_reader_create(
        &r, s->data, &(trip_reader_params){ .engine = TRIP_ENGINE_URING }, s->budget);
    test_caught_reports();
    if (status)
        test_lacks("io_uring");
    else
        trip_reader_destroy(r);
    return !status;
}

static double thread_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

/* Returns true if a read waits at the gate. */
static bool has_come(gate *g)
{
    pthread_mutex_lock(&g->lock);
    bool has = g->waiting > 0;
    pthread_mutex_unlock(&g->lock);
    return has;
}

/* Cancels a frame after `reads` reads, while others wait at the gate. Returns the processor time
 * of the cancellation. */
static double stop_at_gate(desk *d, gate *g, unsigned reads)
{
    trip_drawing drawing;
    pthread_mutex_lock(&g->lock);
    g->open = false;
    g->free = reads;
    g->waiting = 0;
    pthread_mutex_unlock(&g->lock);
    assert_int_equal(trip_frame_begin(&drawing, d->renderer, d->reader, &d->frame), 0);
    for (uint64_t end = trip_now_ns() + 10000000; trip_now_ns() < end || !has_come(g);)
        if (trip_frame_step(&drawing, end) == TRIP_FRAME_WAITS)
            trip_frame_await(&drawing, 1000000);
    assert_false(drawing.done);
    double start = thread_seconds();
    trip_frame_end(&drawing);
    double seconds = thread_seconds() - start;
    pthread_mutex_lock(&g->lock);
    assert_false(g->open || g->failed);
    pthread_mutex_unlock(&g->lock);
    return seconds;
}

static void check_stopping(const scene *s, const scene_renderer *kind, trip_reader_params params)
{
    static float whole[4 * PIXELS], after[4 * PIXELS];
    gate g = closed_gate();
    desk d;
    double min = 1;
    set_up(&d, s, kind, small_slots);
    draw_whole(&d, whole);
    put_away(&d);
    params.slots = 4;
    params.slot_bytes = small_slots.slot_bytes;
    params.fault = pass_gate;
    params.fault_user = &g;
    set_up(&d, s, kind, params);
    for (unsigned reads = 0; reads < 12; reads += 4) {
        double seconds = stop_at_gate(&d, &g, reads);
        min = seconds < min ? seconds : min;
        open_gate(&g);
    }
    if (!(min < 0.005))
        fail_msg("%s: giving up takes %g s of processor time", kind->name, min);
    draw_whole(&d, after);
    assert_memory_equal(whole, after, sizeof whole);
    put_away(&d);
    assert_false(g.failed);
}

static void a_cancelled_frame_waits_for_no_read(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    bool uring = uring_works(&s);
    for (const scene_renderer *kind = scene_renderers(); kind->name; kind++)
        for (int i = 0; i < 4; i++) {
            const trip_reader_params params = { .engine =
                                                    i % 2 ? TRIP_ENGINE_PREAD : TRIP_ENGINE_URING,
                                                .cache_bytes = i / 2 * 50000 };
            if (uring || params.engine != TRIP_ENGINE_URING)
                check_stopping(&s, kind, params);
        }
    scene_destroy(&s);
}

/* Each read takes a different time. */
static long read_unevenly(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    _Atomic uint32_t *count = user;
    (void)data;
    (void)bytes;
    uint32_t ns = scene_hash((int)(offset >> 12), (int)++*count, 0) % 500000;
    nanosleep(&(struct timespec){ .tv_nsec = ns }, NULL);
    return result;
}

static void check_many_stops(const scene *s, const scene_renderer *kind, trip_reader_params params)
{
    static float whole[4 * PIXELS], after[4 * PIXELS];
    _Atomic uint32_t count = 0;
    desk d;
    params.slot_bytes = small_slots.slot_bytes;
    params.fault = read_unevenly;
    params.fault_user = &count;
    set_up(&d, s, kind, params);
    draw_whole(&d, whole);
    for (int i = 0; i < 20; i++) {
        trip_drawing drawing;
        assert_int_equal(trip_frame_begin(&drawing, d.renderer, d.reader, &d.frame), 0);
        for (uint32_t steps = scene_hash(i, 1, 2) % 12; steps > 0; steps--)
            if (trip_frame_step(&drawing, 0) == TRIP_FRAME_WAITS)
                trip_frame_await(&drawing, scene_hash(i, (int)steps, 3) % 400000);
        trip_frame_end(&drawing);
        if (i % 10 != 9)
            continue;
        draw_whole(&d, after);
        assert_memory_equal(whole, after, sizeof whole);
    }
    put_away(&d);
}

static void frames_cancelled_at_random_leave_the_next_one_unchanged(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    bool uring = uring_works(&s);
    for (const scene_renderer *kind = scene_renderers(); kind->name; kind++)
        for (int i = 0; i < 4; i++) {
            const trip_reader_params params = { .engine =
                                                    i % 2 ? TRIP_ENGINE_PREAD : TRIP_ENGINE_URING,
                                                .slots = i == 1 || i == 2 ? 8 : 2,
                                                .cache_bytes = i / 2 * 100000 };
            if (uring || params.engine != TRIP_ENGINE_URING)
                check_many_stops(&s, kind, params);
        }
    scene_destroy(&s);
}

static void a_cancelled_frame_fails_with_one_message(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    for (const scene_renderer *kind = scene_renderers(); kind->name; kind++) {
        static float whole[4 * PIXELS], rgba[4 * PIXELS];
        trip_drawing drawing;
        desk d;
        set_up(&d, &s, kind, small_slots);
        draw_whole(&d, whole);
        assert_int_equal(trip_frame_begin(&drawing, d.renderer, d.reader, &d.frame), 0);
        trip_frame_await(&drawing, UINT64_MAX);
        assert_true(trip_frame_step(&drawing, 0) > 0);
        trip_frame_cancel(&drawing);
        test_catch_reports();
        assert_int_equal(trip_frame_step(&drawing, UINT64_MAX), TRIP_INTERRUPTED);
        assert_int_equal(trip_frame_picture(&drawing, rgba, NULL), TRIP_INTERRUPTED);
        assert_int_equal(trip_frame_step(&drawing, UINT64_MAX), TRIP_INTERRUPTED);
        assert_one_report("triptych: render: frame: interrupted");
        trip_frame_end(&drawing);
        assert_false(trip_interrupted());
        draw_whole(&d, rgba);
        assert_memory_equal(whole, rgba, sizeof whole);
        put_away(&d);
    }
    scene_destroy(&s);
}

/* Counts batches. A batch handed to a renderer is drawn to its end, unless the frame is cancelled.
 */
typedef struct counting {
    trip_renderer base;
    trip_drawing *drawing;
    unsigned cancel_at, draws, ends;
} counting;

static int counting_begin(trip_renderer *r, const trip_frame *frame)
{
    (void)r;
    (void)frame;
    return 0;
}

static int counting_begin_layer(trip_renderer *r, int axis)
{
    (void)r;
    (void)axis;
    return 0;
}

static int counting_draw(trip_renderer *r, const trip_batch *batch, bool front_to_back)
{
    counting *c = (counting *)r;
    (void)batch;
    (void)front_to_back;
    if (++c->draws == c->cancel_at)
        trip_frame_cancel(c->drawing);
    return 0;
}

static void counting_end(trip_renderer *r)
{
    ((counting *)r)->ends++;
}

static void no_batch_is_drawn_after_cancelling(void **state)
{
    (void)state;
    static const trip_renderer_ops ops = {
        .name = "counting",
        .begin_frame = counting_begin,
        .begin_layer = counting_begin_layer,
        .draw = counting_draw,
        .end_frame = counting_end,
    };
    scene s;
    make_scene(&s);
    trip_drawing drawing;
    desk d;
    set_up(&d, &s, scene_renderers(), small_slots);
    counting c = { .base = { .ops = &ops }, .drawing = &drawing, .cancel_at = 3 };
    int status;
    assert_int_equal(trip_frame_begin(&drawing, &c.base, d.reader, &d.frame), 0);
    test_catch_reports();
    while ((status = trip_frame_step(&drawing, UINT64_MAX)) == TRIP_FRAME_WAITS)
        trip_frame_await(&drawing, UINT64_MAX);
    assert_one_report("interrupted");
    assert_int_equal(status, TRIP_INTERRUPTED);
    assert_int_equal(c.draws, 3);
    assert_int_equal(c.ends, 0);
    trip_frame_end(&drawing);
    assert_int_equal(c.ends, 1);
    put_away(&d);
    scene_destroy(&s);
}

static double cpu_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static int create_cpu(trip_renderer **out, trip_budget *budget)
{
    return trip_cpu_create(out, budget, 2);
}

/* Splats are large, so that blending takes long. A cancelled frame must not blend the splats under
 * way. */
static void cancelling_costs_little_compared_with_drawing(void **state)
{
    (void)state;
    static const scene_renderer cpu = { "cpu", create_cpu, 0 };
    const int size = 512;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 64, 64, 64 } });
    scene_colour(&s, 0, 65535, 1, 0.8, 0.6, 0.0001);
    desk d;
    set_up(&d, &s, &cpu, (trip_reader_params){ .engine = TRIP_ENGINE_NULL });
    trip_camera_params view = scene_view(&s, trip_v3(1, 1.2, 0.9), 90, 60, size);
    float *rgba = calloc(4, (size_t)size * (size_t)size * sizeof *rgba);
    assert_non_null(rgba);
    trip_plan_release(&d.plan, s.budget);
    assert_int_equal(trip_camera_make(&d.camera, &view, &s.data->index_to_world), 0);
    assert_int_equal(trip_plan_make(&d.plan, s.data, &d.camera, &d.settings, s.table, s.budget), 0);
    double start = cpu_seconds();
    draw_whole(&d, rgba);
    double whole = cpu_seconds() - start;
    for (int steps = 5; steps <= 35; steps += 10) {
        trip_drawing drawing;
        assert_int_equal(trip_frame_begin(&drawing, d.renderer, d.reader, &d.frame), 0);
        for (int i = 0; i < steps; i++)
            assert_int_equal(trip_frame_step(&drawing, 0), TRIP_FRAME_MORE);
        start = cpu_seconds();
        trip_frame_end(&drawing);
        double end = cpu_seconds() - start;
        if (!(end < whole / 20))
            fail_msg("giving up takes %g s of processor time, the frame %g s", end, whole);
    }
    free(rgba);
    put_away(&d);
    scene_destroy(&s);
}

/* A thread that draws frames of its own scene. */
typedef struct artist {
    pthread_t thread;
    const scene_renderer *kind;
    scene scene;
    trip_drawing drawing; /* of the last frame */
    gate begun;           /* open when the last frame is under way */
    int status, frames;
    bool same;
} artist;

/* Draws frames until one is cancelled. */
static void *draw_until_cancelled(void *user)
{
    artist *a = user;
    desk d;
    float *rgba = calloc(4 * PIXELS, sizeof *rgba);
    trip_scope quiet = { .failed = NULL };
    trip_held_report held;
    trip_scope_enter(&quiet);
    trip_report_hold(&held);
    set_up(&d, &a->scene, a->kind, small_slots);
    d.frame.count = false;
    assert_int_equal(trip_frame_begin(&a->drawing, d.renderer, d.reader, &d.frame), 0);
    open_gate(&a->begun);
    do {
        a->status = trip_frame_step(&a->drawing, 0);
        if (a->status == TRIP_FRAME_WAITS)
            trip_frame_await(&a->drawing, 1000000);
        if (a->status > 0)
            a->status = trip_frame_picture(&a->drawing, rgba, NULL);
    } while (a->status == 0 && !a->drawing.done);
    while (a->status == 0) /* the frame ended before its cancellation: draw again */
        a->status = trip_frame_picture(&a->drawing, rgba, NULL);
    trip_frame_end(&a->drawing);
    trip_report_release(&held);
    a->same = strstr(held.line, "interrupted") != NULL;
    put_away(&d);
    free(rgba);
    return NULL;
}

static void *draw_often(void *user)
{
    artist *a = user;
    desk d;
    float *first = calloc(4 * PIXELS, sizeof *first), *rgba = calloc(4 * PIXELS, sizeof *rgba);
    set_up(&d, &a->scene, a->kind, small_slots);
    a->same = true;
    for (a->frames = 0; a->frames < 4 && a->status == 0; a->frames++) {
        trip_frame_stats stats;
        float *to = a->frames ? rgba : first;
        a->status = trip_frame_draw(d.renderer, d.reader, &d.frame, to, NULL, &stats);
        a->same &= a->frames == 0 || !memcmp(first, rgba, 4 * PIXELS * sizeof *rgba);
    }
    put_away(&d);
    free(first);
    free(rgba);
    return NULL;
}

static void frames_of_two_data_sets_are_drawn_in_two_threads(void **state)
{
    (void)state;
    static const scene_renderer kinds[] = { { "cpu", create_cpu, 0 },
                                            { "reference", trip_reference_create, 0 } };
    for (int i = 0; i < 2; i++) {
        static artist cancelled, calm;
        cancelled = (artist){ .kind = &kinds[i], .begun = closed_gate() };
        calm = (artist){ .kind = &kinds[i] };
        make_scene(&cancelled.scene);
        make_scene(&calm.scene);
        assert_int_equal(pthread_create(&cancelled.thread, NULL, draw_until_cancelled, &cancelled),
                         0);
        assert_int_equal(pthread_create(&calm.thread, NULL, draw_often, &calm), 0);
        pass_gate(&cancelled.begun, NULL, 0, 0, 0);
        trip_frame_cancel(&cancelled.drawing);
        pthread_join(cancelled.thread, NULL);
        pthread_join(calm.thread, NULL);
        assert_int_equal(cancelled.status, TRIP_INTERRUPTED);
        assert_true(cancelled.same);
        assert_int_equal(calm.status, 0);
        assert_int_equal(calm.frames, 4);
        assert_true(calm.same);
        scene_destroy(&cancelled.scene);
        scene_destroy(&calm.scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(steps_and_inspections_leave_the_picture_the_same),
        cmocka_unit_test(a_batch_is_drawn_in_pieces_when_there_is_a_deadline),
        cmocka_unit_test(a_step_does_not_wait_for_the_disk),
        cmocka_unit_test(a_frame_cancelled_during_reads_leaves_the_next_one_unchanged),
        cmocka_unit_test(a_cancelled_frame_waits_for_no_read),
        cmocka_unit_test(frames_cancelled_at_random_leave_the_next_one_unchanged),
        cmocka_unit_test(a_cancelled_frame_fails_with_one_message),
        cmocka_unit_test(no_batch_is_drawn_after_cancelling),
        cmocka_unit_test(cancelling_costs_little_compared_with_drawing),
        cmocka_unit_test(frames_of_two_data_sets_are_drawn_in_two_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
