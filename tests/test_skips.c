/* Tests the support for tests. A skipped test does not count as passed, and assert_one_report("")
 * fails. */
#include "skips.h"
#include "test.h"

#include <sys/wait.h>
#include <unistd.h>

static void passes(void **state)
{
    (void)state;
}

static void is_skipped(void **state)
{
    (void)state;
    skip();
}

static void lacks_a_part(void **state)
{
    (void)state;
    test_lacks("a part");
}

static void does_fail(void **state)
{
    (void)state;
    fail();
}

/* Returns the exit status of a program with these two tests. Its output is discarded. */
static int status_of(CMUnitTestFunction first, CMUnitTestFunction second)
{
    const struct CMUnitTest tests[] = { cmocka_unit_test(first), cmocka_unit_test(second) };
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        if (!freopen("/dev/null", "w", stdout) || !freopen("/dev/null", "w", stderr))
            _exit(99);
        _exit(cmocka_run_group_tests(tests, NULL, NULL));
    }
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static void a_program_with_a_skip_and_no_failure_ends_with_77(void **state)
{
    (void)state;
    assert_int_equal(status_of(passes, passes), 0);
    assert_int_equal(status_of(passes, is_skipped), 77);
    assert_int_equal(status_of(lacks_a_part, passes), 77);
    assert_int_equal(status_of(is_skipped, does_fail), 1);
    assert_int_equal(status_of(lacks_a_part, does_fail), 1);
}

static void expects_any_report(void **state)
{
    (void)state;
    test_catch_reports();
    trip_fail(TRIP_ERROR, "test", "here", "why");
    assert_one_report("");
}

static void expects_this_report(void **state)
{
    (void)state;
    test_catch_reports();
    trip_fail(TRIP_ERROR, "test", "here", "why");
    assert_one_report("here: why");
}

static void an_expected_report_must_be_named(void **state)
{
    (void)state;
    assert_int_equal(status_of(passes, expects_this_report), 0);
    assert_int_equal(status_of(passes, expects_any_report), 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_program_with_a_skip_and_no_failure_ends_with_77),
        cmocka_unit_test(an_expected_report_must_be_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
