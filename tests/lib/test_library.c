/* The library as others use it: its header and its shared object alone. */
#include <triptych.h>

#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { SIZE = 96, FLOATS = 4 * SIZE * SIZE };

#define DATA_SET "library.trip"

static triptych *new_context(void)
{
    triptych *t;
    assert_int_equal(triptych_create(&t), TRIPTYCH_OK);
    assert_string_equal(triptych_error(t), "");
    return t;
}

static int brick(void **state)
{
    (void)state;
    triptych *t = new_context();
    const char *const functions[] = { "grey", NULL };
    int status = triptych_brick(t, TRIP_SOURCE_DIR "/datasets/tooth.nhdr", DATA_SET, functions,
                                &(triptych_resources){ .memory_bytes = 64 << 20, .threads = 2 });
    if (status)
        print_error("%s\n", triptych_error(t));
    triptych_destroy(t);
    return status;
}

static int remove_data(void **state)
{
    (void)state;
    return system("rm -r " DATA_SET);
}

static void open_data(triptych *t, triptych_renderer renderer)
{
    assert_int_equal(
        triptych_open(
            t, DATA_SET,
            &(triptych_resources){ .memory_bytes = 64 << 20, .threads = 2, .renderer = renderer }),
        TRIPTYCH_OK);
    assert_int_equal(
        triptych_set_view(t,
                          &(triptych_view){ .width = SIZE, .height = SIZE, .side = TRIPTYCH_ISO }),
        TRIPTYCH_OK);
}

static void assert_fails(const triptych *t, int status, int expected, const char *text)
{
    if (status != expected || !strstr(triptych_error(t), text))
        fail_msg("%d, \"%s\": not %d, \"%s\"", status, triptych_error(t), expected, text);
    assert_null(strchr(triptych_error(t), '\n'));
}

static void info_is_that_of_the_volume(void **state)
{
    (void)state;
    triptych *t = new_context();
    triptych_info info;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_get_info(t, &info), TRIPTYCH_OK);
    /* As datasets/tooth.nhdr says. */
    assert_int_equal(info.dims[0], 103);
    assert_int_equal(info.dims[1], 94);
    assert_int_equal(info.dims[2], 161);
    assert_true(info.kept > 0 && info.kept < 103 * 94 * 161);
    assert_true(info.bytes > 0);
    assert_int_equal(info.lists, 3);
    assert_int_equal(info.normals, 1);
    assert_true(info.value_min < info.value_max);
    for (int a = 0; a < 3; a++) {
        double corner = info.index_to_world[a][3];
        double far = corner + info.index_to_world[a][0] * 102 + info.index_to_world[a][1] * 93 +
                     info.index_to_world[a][2] * 160;
        assert_true(info.lo[a] < info.hi[a]);
        assert_true(info.lo[a] >= fmin(corner, far) - 1e-9);
        assert_true(info.hi[a] <= fmax(corner, far) + 1e-9);
    }
    triptych_destroy(t);
}

static void what_fails_says_why_and_the_context_goes_on(void **state)
{
    (void)state;
    static float rgba[FLOATS];
    triptych *t = new_context();
    triptych_info info;
    triptych_settings bad = triptych_default_settings();
    bad.h = 1;
    assert_fails(t, triptych_draw(t, rgba), TRIPTYCH_USAGE, "no data set is open");
    assert_fails(t, triptych_get_info(t, &info), TRIPTYCH_USAGE, "no data set is open");
    assert_fails(t, triptych_open(t, "none.trip", NULL), TRIPTYCH_ERROR, "none.trip");
    assert_fails(t, triptych_open(t, DATA_SET, &(triptych_resources){ .memory_bytes = 4096 }),
                 TRIPTYCH_ERROR, "memory");
    assert_fails(t, triptych_step(t, 0), TRIPTYCH_USAGE, "none is begun");
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_string_equal(triptych_error(t), "");
    assert_fails(t, triptych_set_settings(t, &bad), TRIPTYCH_USAGE, "h lies between");
    assert_fails(t, triptych_set_view(t, &(triptych_view){ .zoom = NAN }), TRIPTYCH_USAGE,
                 "finite");
    assert_fails(t, triptych_set_view(t, &(triptych_view){ .width = -1 }), TRIPTYCH_USAGE,
                 "pixels");
    assert_fails(t, triptych_set_view(t, &(triptych_view){ .up = (double[3]){ 0 } }),
                 TRIPTYCH_USAGE, "up is zero");
    assert_fails(t, triptych_turn(t, INFINITY), TRIPTYCH_USAGE, "finite");
    assert_fails(t, triptych_set_function(t, &(triptych_function){ .name = "preset:no-such" }),
                 TRIPTYCH_USAGE, "no-such");
    assert_fails(t, triptych_write(t, "p.gif", SIZE, SIZE, rgba), TRIPTYCH_USAGE, "p.gif");
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    assert_fails(t, triptych_begin(t), TRIPTYCH_USAGE, "end it first");
    assert_fails(t, triptych_set_function(t, NULL), TRIPTYCH_USAGE, "end it first");
    assert_fails(t, triptych_open(t, DATA_SET, NULL), TRIPTYCH_USAGE, "end it first");
    triptych_end(t);
    assert_int_equal(triptych_draw(t, rgba), TRIPTYCH_OK);
    triptych_destroy(t);
    triptych_destroy(NULL);
}

static void count_message(void *user, const char *line)
{
    assert_non_null(strstr(line, "triptych: "));
    ++*(int *)user;
}

static void messages_go_to_whoever_takes_them(void **state)
{
    (void)state;
    triptych *t = new_context();
    int messages = 0, left_out = -1, ends[2], keep = dup(STDERR_FILENO);
    char text[16];
    assert_int_equal(pipe(ends), 0);
    dup2(ends[1], STDERR_FILENO);
    open_data(t, TRIPTYCH_RENDERER_CPU);
    /* Nothing of the volume lies there. */
    const triptych_function none = { .window = 1, .level = 1e9, .name = "grey" };
    int silent = triptych_set_function(t, &none);
    triptych_set_messages(t, count_message, &messages);
    int told = triptych_set_function(t, &none);
    int failed = triptych_open(t, "none.trip", NULL);
    dup2(keep, STDERR_FILENO);
    close(keep);
    close(ends[1]);
    assert_int_equal(read(ends[0], text, sizeof text), 0);
    close(ends[0]);
    assert_int_equal(silent, TRIPTYCH_OK);
    assert_int_equal(told, TRIPTYCH_OK);
    assert_int_equal(failed, TRIPTYCH_ERROR);
    assert_int_equal(messages, 2);
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(
        triptych_set_function(t, &(triptych_function){ .name = "grey", .left_out = &left_out }),
        TRIPTYCH_OK);
    assert_int_equal(left_out, 0);
    triptych_destroy(t);
}

static void steps_draw_what_one_call_draws(void **state)
{
    (void)state;
    static float whole[FLOATS], stepped[FLOATS];
    triptych *t = new_context();
    int status, steps = 0;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_draw(t, whole), TRIPTYCH_OK);
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    while ((status = triptych_step(t, 0)) > 0) {
        assert_int_equal(triptych_await(t, UINT64_MAX), TRIPTYCH_OK);
        if (steps++ % 8 == 0)
            assert_int_equal(triptych_picture(t, stepped), TRIPTYCH_OK);
    }
    assert_int_equal(status, TRIPTYCH_DONE);
    assert_int_equal(triptych_picture(t, stepped), TRIPTYCH_OK);
    triptych_end(t);
    assert_true(steps > 3);
    assert_memory_equal(whole, stepped, sizeof whole);
    triptych_destroy(t);
}

static void a_frame_given_up_leaves_the_next_one_as_it_is(void **state)
{
    (void)state;
    static float whole[FLOATS], after[FLOATS];
    triptych *t = new_context();
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_draw(t, whole), TRIPTYCH_OK);
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    assert_true(triptych_step(t, 0) > 0);
    triptych_end(t);
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    triptych_cancel(t);
    assert_fails(t, triptych_step(t, UINT64_MAX), TRIPTYCH_CANCELLED, "interrupted");
    assert_int_equal(triptych_picture(t, after), TRIPTYCH_CANCELLED);
    triptych_end(t);
    assert_int_equal(triptych_draw(t, after), TRIPTYCH_OK);
    assert_memory_equal(whole, after, sizeof whole);
    triptych_destroy(t);
}

static void a_turned_view_can_be_turned_back(void **state)
{
    (void)state;
    static float first[FLOATS], half[FLOATS], back[FLOATS];
    triptych *t = new_context();
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_draw(t, first), TRIPTYCH_OK);
    assert_int_equal(triptych_turn(t, 180), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, half), TRIPTYCH_OK);
    assert_int_equal(triptych_turn(t, 0), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, back), TRIPTYCH_OK);
    assert_memory_equal(first, back, sizeof first);
    assert_memory_not_equal(first, half, sizeof first);
    triptych_destroy(t);
}

/* A thread with a context of its own. */
typedef struct worker {
    pthread_t thread;
    triptych *t;
    float *rgba;
    int status, frames;
    int same;
    char error[256];
} worker;

/* The frame is begun already, so that cancelling is noticed whenever it comes. */
static void *draw_until_cancelled(void *user)
{
    worker *w = user;
    while (w->status >= 0)
        if ((w->status = triptych_step(w->t, 0)) >= 0)
            w->status = triptych_picture(w->t, w->rgba);
    snprintf(w->error, sizeof w->error, "%s", triptych_error(w->t));
    triptych_end(w->t);
    return NULL;
}

static void *draw_some(void *user)
{
    worker *w = user;
    float *first = malloc(FLOATS * sizeof *first);
    w->same = 1;
    for (int i = 0; i < 3 && w->status == TRIPTYCH_OK; i++) {
        w->status = triptych_draw(w->t, w->rgba);
        if (i == 0)
            memcpy(first, w->rgba, FLOATS * sizeof *first);
        w->same &= !memcmp(first, w->rgba, FLOATS * sizeof *first);
        w->frames++;
    }
    free(first);
    return NULL;
}

static void two_contexts_draw_in_two_threads_and_one_is_cancelled(void **state)
{
    (void)state;
    worker w[2] = { { .status = 0 }, { .status = 0 } };
    for (int i = 0; i < 2; i++) {
        w[i].t = new_context();
        w[i].rgba = malloc(FLOATS * sizeof *w[i].rgba);
        open_data(w[i].t, TRIPTYCH_RENDERER_CPU);
    }
    assert_int_equal(triptych_begin(w[0].t), TRIPTYCH_OK);
    assert_int_equal(pthread_create(&w[0].thread, NULL, draw_until_cancelled, &w[0]), 0);
    assert_int_equal(pthread_create(&w[1].thread, NULL, draw_some, &w[1]), 0);
    pthread_join(w[1].thread, NULL);
    triptych_cancel(w[0].t);
    pthread_join(w[0].thread, NULL);
    assert_int_equal(w[0].status, TRIPTYCH_CANCELLED);
    assert_non_null(strstr(w[0].error, "interrupted"));
    assert_int_equal(w[1].status, TRIPTYCH_OK);
    assert_string_equal(triptych_error(w[1].t), "");
    assert_int_equal(w[1].frames, 3);
    assert_true(w[1].same);
    for (int i = 0; i < 2; i++) {
        triptych_destroy(w[i].t);
        free(w[i].rgba);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(info_is_that_of_the_volume),
        cmocka_unit_test(what_fails_says_why_and_the_context_goes_on),
        cmocka_unit_test(messages_go_to_whoever_takes_them),
        cmocka_unit_test(steps_draw_what_one_call_draws),
        cmocka_unit_test(a_frame_given_up_leaves_the_next_one_as_it_is),
        cmocka_unit_test(a_turned_view_can_be_turned_back),
        cmocka_unit_test(two_contexts_draw_in_two_threads_and_one_is_cancelled),
    };
    return cmocka_run_group_tests(tests, brick, remove_data);
}
