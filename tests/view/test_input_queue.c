#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "input_queue.h"

static const trip_event move = { .kind = TRIP_EVENT_MOVE, .x = 3, .y = 4 };
static const trip_event press = { .kind = TRIP_EVENT_BUTTON, .down = true };
static const trip_event release = { .kind = TRIP_EVENT_BUTTON };
static const trip_event wheel = { .kind = TRIP_EVENT_WHEEL, .y = 1 };
static const trip_event letter = { .kind = TRIP_EVENT_TEXT, .code = 'a' };

static trip_event key(int code, bool down)
{
    return (trip_event){ .kind = TRIP_EVENT_KEY, .code = code, .down = down };
}

/* Hands out events until a picture is needed. Returns their number. */
static int take(trip_input_queue *q)
{
    trip_queued_event one;
    int count = 0;
    while (trip_input_queue_next(q, &one)) {
        free(one.event.text);
        count++;
    }
    return count;
}

/* Pushes events, and compares the number of events before each picture with `counts`. */
static void assert_pictures(const trip_event *events, int event_count, const int *counts, int count)
{
    trip_input_queue q = { 0 };
    for (int i = 0; i < event_count; i++)
        trip_input_queue_push(&q, &events[i], i);
    for (int i = 0; i < count; i++) {
        assert_int_equal(take(&q), counts[i]);
        trip_input_queue_drawn(&q);
    }
    assert_int_equal(q.count, 0);
    trip_input_queue_free(&q);
}

#define ASSERT_PICTURES(events, ...)                                                               \
    assert_pictures(events, sizeof(events) / sizeof *(events), (const int[]){ __VA_ARGS__ },       \
                    sizeof((const int[]){ __VA_ARGS__ }) / sizeof(int))

static void a_click_takes_three_pictures(void **state)
{
    (void)state;
    const trip_event click[] = { move, move, press, release };
    ASSERT_PICTURES(click, 2, 1, 1);
}

static void a_drag_starts_where_it_was_pressed(void **state)
{
    (void)state;
    const trip_event drag[] = { move, press, move, move, release };
    ASSERT_PICTURES(drag, 1, 1, 2, 1);
}

static void the_wheel_turns_where_the_pointer_is(void **state)
{
    (void)state;
    const trip_event turns[] = { wheel, wheel, move, wheel };
    ASSERT_PICTURES(turns, 2, 1, 1);
}

static void a_key_changes_once_a_picture(void **state)
{
    (void)state;
    const trip_event keys[] = { key('a', true), key('b', true), key('a', false), key('b', false) };
    ASSERT_PICTURES(keys, 2, 2);
}

/* The first picture after a click gives a text field the focus. The second one tells the window. */
static void text_waits_for_the_click_before_it(void **state)
{
    (void)state;
    const trip_event typed[] = { press, key('a', true), letter, key(TRIP_KEY_BACKSPACE, true) };
    ASSERT_PICTURES(typed, 1, 0, 2, 1);
}

static void releases_follow_the_presses_that_wait(void **state)
{
    (void)state;
    trip_input_queue q = { 0 };
    trip_queued_event one;
    const trip_event held = key('w', true);
    trip_input_queue_push(&q, &press, 1);
    trip_input_queue_push(&q, &held, 2);
    trip_input_queue_release_all(&q, 3);
    trip_input_queue_release_all(&q, 4); /* nothing is down */
    assert_int_equal(q.count, 4);
    const bool down[] = { true, true, false, false };
    const double seconds[] = { 1, 2, 3, 3 };
    for (int i = 0; i < 4; i++) {
        while (!trip_input_queue_next(&q, &one))
            trip_input_queue_drawn(&q);
        assert_int_equal(one.event.down, down[i]);
        assert_true(one.seconds == seconds[i]);
    }
    trip_input_queue_free(&q);
}

static void events_keep_their_order_and_their_texts(void **state)
{
    (void)state;
    trip_input_queue q = { 0 };
    trip_queued_event one;
    char text[16];
    for (int i = 0, taken = 0; i < 1000; i++) {
        strcpy(text, "file");
        trip_input_queue_push(&q, &(trip_event){ .kind = TRIP_EVENT_DROP, .x = i, .text = text },
                              i);
        strcpy(text, "other");
        if (i % 3) /* the queue grows, and its start moves */
            continue;
        assert_true(trip_input_queue_next(&q, &one));
        assert_true(one.event.x == taken++);
        assert_string_equal(one.event.text, "file");
        free(one.event.text);
    }
    assert_int_equal(q.count, 666);
    trip_input_queue_free(&q);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_click_takes_three_pictures),
        cmocka_unit_test(a_drag_starts_where_it_was_pressed),
        cmocka_unit_test(the_wheel_turns_where_the_pointer_is),
        cmocka_unit_test(a_key_changes_once_a_picture),
        cmocka_unit_test(text_waits_for_the_click_before_it),
        cmocka_unit_test(releases_follow_the_presses_that_wait),
        cmocka_unit_test(events_keep_their_order_and_their_texts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
