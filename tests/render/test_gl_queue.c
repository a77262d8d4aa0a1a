/* The GPU's work in parts: none is begun once the frame is given up. */
#include "gl/queue.h"

#include "gl/gl_context.h"
#include "report.h"
#include "test.h"

static void no_part_is_ended_as_if_wanted_when_the_frame_is_given_up(void **state)
{
    (void)state;
    trip_gl_context *context;
    trip_gl_queue queue = { .ended = 0 };
    trip_scope scope = { .around = trip_scope_current() };
    trip_scope *before = trip_scope_enter(&scope);
    if (trip_gl_context_create(&context)) {
        trip_scope_enter(before);
        skip();
    }
    assert_int_equal(trip_gl_queue_end_part(&queue), TRIP_OK);
    trip_scope_cancel(&scope);
    assert_int_equal(trip_gl_queue_end_part(&queue), TRIP_INTERRUPTED);
    trip_gl_queue_drain(&queue);
    assert_true(queue.done == 2);
    trip_gl_context_destroy(context);
    trip_scope_enter(before);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_part_is_ended_as_if_wanted_when_the_frame_is_given_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
