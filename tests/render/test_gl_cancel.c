/* Cancels a frame of the gl renderer. No call may wait for the device's work, and in the next
 * frame only picture() may. The test counts the calls of OpenGL that wait, and makes a finished
 * device appear busy. */
#include <epoxy/gl.h>
#include <string.h>

#include "desk.h"

static struct {
    PFNGLFINISHPROC finish;
    PFNGLCLIENTWAITSYNCPROC client_wait;
    unsigned waits; /* calls that may wait */
    bool busy;      /* the device appears busy */
} device;

static void EPOXY_CALLSPEC counting_finish(void)
{
    device.waits++;
    device.finish();
}

static GLenum EPOXY_CALLSPEC counting_wait(GLsync fence, GLbitfield flags, GLuint64 timeout_ns)
{
    device.waits += timeout_ns > 0;
    if (device.busy)
        return GL_TIMEOUT_EXPIRED;
    return device.client_wait(fence, flags, timeout_ns);
}

/* Replaces the functions of OpenGL that wait. The renderer's context must be current, so that
 * epoxy has resolved them. */
static void watch_device(void)
{
    GLsync fence = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    glFinish();
    glClientWaitSync(fence, 0, 0);
    glDeleteSync(fence);
    device.finish = epoxy_glFinish;
    device.client_wait = epoxy_glClientWaitSync;
    epoxy_glFinish = counting_finish;
    epoxy_glClientWaitSync = counting_wait;
    device.waits = 0;
}

static void stop_watching(void)
{
    epoxy_glFinish = device.finish;
    epoxy_glClientWaitSync = device.client_wait;
    device.busy = false;
}

/* Steps until a given number of steps has drawn something. */
static void begin_and_draw(desk *d, trip_drawing *drawing, int steps)
{
    assert_int_equal(trip_frame_begin(drawing, d->renderer, d->reader, &d->frame), 0);
    while (steps > 0) {
        int status = trip_frame_step(drawing, 0);
        assert_true(status > 0);
        if (status == TRIP_FRAME_WAITS)
            trip_frame_await(drawing, UINT64_MAX);
        steps -= status == TRIP_FRAME_MORE;
    }
}

/* Cancels the frame while the device is busy. */
static void give_up(trip_drawing *drawing)
{
    device.waits = 0;
    device.busy = true;
    trip_frame_cancel(drawing);
    test_catch_reports();
    assert_int_equal(trip_frame_step(drawing, UINT64_MAX), TRIP_INTERRUPTED);
    assert_one_report("interrupted");
    trip_frame_end(drawing);
    assert_int_equal(device.waits, 0);
}

/* Begins the next frame. It must draw nothing while the device is busy, and everything afterwards.
 */
static void draw_next(desk *d, float *rgba)
{
    trip_drawing drawing;
    int status;
    assert_int_equal(trip_frame_begin(&drawing, d->renderer, d->reader, &d->frame), 0);
    for (int i = 0; i < 3; i++)
        assert_int_equal(trip_frame_step(&drawing, UINT64_MAX), TRIP_FRAME_WAITS);
    assert_int_equal(device.waits, 0);
    device.busy = false;
    while ((status = trip_frame_step(&drawing, 0)) > 0)
        if (status == TRIP_FRAME_WAITS)
            trip_frame_await(&drawing, UINT64_MAX);
    assert_int_equal(status, TRIP_FRAME_DONE);
    assert_int_equal(trip_frame_picture(&drawing, rgba, NULL), 0);
    trip_frame_end(&drawing);
}

static void check(const scene *s, trip_classify classify, trip_reader_params params)
{
    static const scene_renderer gl = { "gl", trip_gl_create, 0 };
    static float whole[4 * PIXELS], next[4 * PIXELS];
    desk d;
    trip_drawing drawing;
    set_up_to(&d, s, &gl, params, classify);
    draw_whole(&d, whole);
    watch_device();
    for (int steps = 2; steps <= 14; steps += 4) {
        begin_and_draw(&d, &drawing, steps);
        give_up(&drawing);
        draw_next(&d, next);
        assert_memory_equal(whole, next, sizeof whole);
    }
    stop_watching();
    put_away(&d);
}

static void cancelling_waits_for_nothing_and_keeps_the_next_frame(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    check(&s, TRIP_CLASSIFY_PRE, small_slots);
    check(&s, TRIP_CLASSIFY_POST, small_slots);
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cancelling_waits_for_nothing_and_keeps_the_next_frame),
    };
    if (!scene_has_gl())
        return 77;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
