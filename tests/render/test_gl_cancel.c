/* A frame of the gl renderer that is given up: what the device has under way is waited for by no
 * call, and by no call of the next frame but in picture(). Calls of OpenGL that wait are counted,
 * and a device that is not done is made of one that is. */
#include <epoxy/gl.h>
#include <string.h>

#include "desk.h"

static struct {
    PFNGLFINISHPROC finish;
    PFNGLCLIENTWAITSYNCPROC client_wait;
    unsigned waits; /* calls that may wait */
    bool busy;      /* nothing is done yet */
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

/* With the renderer's context current: by now the functions are found. */
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

/* Takes steps until so many drew something. */
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

/* Gives the frame up while the device is not done. */
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

/* The next frame begins, draws nothing while the device is at work, and then all. */
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

static bool lacks_gl(const scene *s)
{
    trip_renderer *r;
    if (trip_gl_create(&r, s->budget))
        return true;
    r->ops->destroy(r);
    return false;
}

static void giving_up_waits_for_nothing_and_leaves_the_next_frame_as_it_is(void **state)
{
    (void)state;
    scene s;
    make_scene(&s);
    if (lacks_gl(&s))
        skip();
    check(&s, TRIP_CLASSIFY_PRE, small_slots);
    check(&s, TRIP_CLASSIFY_POST, small_slots);
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(giving_up_waits_for_nothing_and_leaves_the_next_frame_as_it_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
