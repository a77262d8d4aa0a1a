/* Reports that a table keeps in the place of printing them. */
#include "bench_frame.h"

#include "report.h"
#include "test.h"

/* What is kept under a scope whose lines are caught: why a part of a table was left out. */
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

static void a_fault_is_kept_without_the_name_of_the_program(void **state)
{
    (void)state;
    char why[256] = "";
    test_catch_reports();
    fail_in_scope(why, false, TRIP_ERROR, "no room");
    assert_string_equal(why, "a: b: no room");
    assert_int_equal(test_caught_reports(), 0);
}

static void an_interruption_is_printed_and_not_kept(void **state)
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
        cmocka_unit_test(a_fault_is_kept_without_the_name_of_the_program),
        cmocka_unit_test(an_interruption_is_printed_and_not_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
