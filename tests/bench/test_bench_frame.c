/* Tests reports that a table keeps and does not print. */
#include "bench_frame.h"

#include "report.h"
#include "test.h"

/* Fails in a scope with caught reports. `why` gets the reason for which a part of a table was left
 * out. */
static void fail_in_scope(char why[256], bool cancelled, int status, const char *name)
{
    trip_scope scope = { .around = trip_scope_current() };
    trip_scope *before = trip_scope_enter(&scope);
    if (cancelled)
        trip_scope_cancel(before);
    bench_keep_report(why);
    assert_int_equal(trip_fail(status, "a", "b", "%s", name), status);
    bench_keep_report(NULL);
    trip_scope_enter(before);
    trip_scope_renew(before);
}

static void a_failure_is_kept_without_the_program_name(void **state)
{
    (void)state;
    char why[256] = "";
    test_catch_reports();
    fail_in_scope(why, false, TRIP_ERROR, "no room");
    assert_string_equal(why, "a: b: no room");
    assert_int_equal(test_caught_reports(), 0);
}

static void an_interrupt_is_printed_and_not_kept(void **state)
{
    (void)state;
    char why[256] = "";
    test_catch_reports();
    fail_in_scope(why, true, TRIP_INTERRUPTED, "interrupted");
    assert_string_equal(why, "");
    assert_one_report("interrupted");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_failure_is_kept_without_the_program_name),
        cmocka_unit_test(an_interrupt_is_printed_and_not_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
