/* The GPU's work in parts. No part begins after the frame is cancelled. */
#include "gl/queue.h"

#include "gl/gl_context.h"
#include "report.h"
#include "scenes.h"
#include "test.h"

static void a_cancelled_frame_ends_no_part_normally(void **state)
{
    (void)state;
    trip_gl_context *context;
    trip_gl_queue queue = { .ended = 0 };
    trip_scope scope = { .around = trip_scope_current() };
    trip_scope *before = trip_scope_enter(&scope);
    assert_int_equal(trip_gl_context_create(&context), TRIP_OK);
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
        cmocka_unit_test(a_cancelled_frame_ends_no_part_normally),
    };
    if (!scene_has_gl())
        return 77;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
