#include "test.h"

#include <errno.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

static void failure_is_one_line_with_stage_place_and_cause(void **state)
{
    (void)state;
    test_catch_reports();
    assert_int_equal(trip_fail(TRIP_USAGE, "read", "a.nrrd: line 3", "%d axes, not 3", 4),
                     TRIP_USAGE);
    assert_one_report("triptych: read: a.nrrd: line 3: 4 axes, not 3");
}

static void empty_place_is_left_out(void **state)
{
    (void)state;
    test_catch_reports();
    trip_fail(TRIP_ERROR, "memory", "", "none left");
    assert_one_report("triptych: memory: none left");
}

static void control_characters_are_made_visible(void **state)
{
    (void)state;
    test_catch_reports();
    trip_fail(TRIP_ERROR, "read", "a\nb\x1b[31m", "%s",
              "c\td\x7f"
              "e\xc2\x85");
    assert_one_report("triptych: read: a\\nb\\x1b[31m: c\\td\\x7fe\\xc2\\x85");
}

static void letters_beyond_ascii_stay(void **state)
{
    (void)state;
    test_catch_reports();
    trip_fail(TRIP_ERROR, "read",
              "gr\xc3\xbc\xc3\x9f"
              "e.tf",
              "no");
    assert_one_report("gr\xc3\xbc\xc3\x9f"
                      "e.tf");
}

static void bad_utf8_and_marks_of_direction_are_made_visible(void **state)
{
    (void)state;
    test_catch_reports();
    trip_fail(TRIP_ERROR, "read", "a\xff\xc3(", "\xe2\x80\xae%s\xed\xa0\x80\xc0\xaf\xe2\x82", "b");
    assert_one_report("triptych: read: a\\xff\\xc3(: \\xe2\\x80\\xaeb\\xed\\xa0\\x80\\xc0\\xaf"
                      "\\xe2\\x82");
}

static void a_cut_line_holds_whole_characters(void **state)
{
    (void)state;
    for (int shift = 0; shift < 3; shift++) {
        char text[9000] = "";
        for (int i = 0; i < 2500; i++)
            strcat(text, i < shift ? "x" : "\xe2\x82\xac");
        test_catch_reports();
        trip_fail(TRIP_ERROR, "read", text, "%s", text);
        assert_one_report("\xe2\x82\xac...");
        assert_null(strstr(test_last_report, "\\x"));
    }
}

static void overlong_line_is_cut_and_marked(void **state)
{
    (void)state;
    char longname[10000];
    memset(longname, 'x', sizeof longname - 1);
    longname[sizeof longname - 1] = 0;
    test_catch_reports();
    trip_fail(TRIP_ERROR, "read", "a.raw", "%s", longname);
    assert_one_report("xxx...");
    assert_true(strlen(test_last_report) < 4096);
    test_catch_reports();
    trip_fail(TRIP_ERROR, "read", longname, "why");
    assert_one_report("triptych: read: ...xxx");
    assert_non_null(strstr(test_last_report, "xxx: why"));
}

static void errno_text_follows_the_action(void **state)
{
    (void)state;
    test_catch_reports();
    errno = ENOENT;
    assert_int_equal(trip_fail_errno("read", "x.raw", "cannot open"), TRIP_ERROR);
    assert_one_report("triptych: read: x.raw: cannot open: No such file or directory");
    test_catch_reports();
    errno = EACCES;
    trip_fail_errno("read", "x.raw", NULL);
    assert_one_report("triptych: read: x.raw: Permission denied");
}

static void reporting_leaves_errno_alone(void **state)
{
    (void)state;
    test_catch_reports();
    errno = EIO;
    trip_warn("x.raw", "odd");
    assert_int_equal(errno, EIO);
    assert_one_report("triptych: warning: x.raw: odd");
}

static void without_a_sink_lines_go_to_stderr(void **state)
{
    (void)state;
    char text[64] = "";
    int pipe_ends[2], keep = dup(STDERR_FILENO);
    assert_int_equal(pipe(pipe_ends), 0);
    dup2(pipe_ends[1], STDERR_FILENO);
    trip_fail(TRIP_ERROR, "a", "b", "c");
    dup2(keep, STDERR_FILENO);
    close(keep);
    close(pipe_ends[1]);
    ssize_t length = read(pipe_ends[0], text, sizeof text - 1);
    close(pipe_ends[0]);
    assert_int_equal(length, strlen("triptych: a: b: c\n"));
    assert_string_equal(text, "triptych: a: b: c\n");
}

static void first_signal_sets_a_flag(void **state)
{
    (void)state;
    trip_interrupt_install();
    assert_false(trip_interrupted());
    raise(SIGINT);
    assert_true(trip_interrupted());
    trip_interrupt_install();
    assert_false(trip_interrupted());
    raise(SIGTERM);
    assert_true(trip_interrupted());
}

static void an_interruption_is_told_once(void **state)
{
    (void)state;
    trip_interrupt_install();
    raise(SIGINT);
    test_catch_reports();
    assert_int_equal(trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted"), TRIP_INTERRUPTED);
    assert_int_equal(trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted"), TRIP_INTERRUPTED);
    assert_one_report("triptych: brick: interrupted");
    trip_interrupt_install();
}

static void second_signal_ends_the_process(void **state)
{
    (void)state;
    int status = 0;
    pid_t child = fork();
    if (child == 0) {
        trip_interrupt_install();
        raise(SIGINT);
        raise(SIGTERM);
        _exit(0);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status));
    assert_int_equal(WTERMSIG(status), SIGTERM);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(failure_is_one_line_with_stage_place_and_cause),
        cmocka_unit_test(empty_place_is_left_out),
        cmocka_unit_test(control_characters_are_made_visible),
        cmocka_unit_test(letters_beyond_ascii_stay),
        cmocka_unit_test(bad_utf8_and_marks_of_direction_are_made_visible),
        cmocka_unit_test(a_cut_line_holds_whole_characters),
        cmocka_unit_test(overlong_line_is_cut_and_marked),
        cmocka_unit_test(errno_text_follows_the_action),
        cmocka_unit_test(reporting_leaves_errno_alone),
        cmocka_unit_test(without_a_sink_lines_go_to_stderr),
        cmocka_unit_test(first_signal_sets_a_flag),
        cmocka_unit_test(an_interruption_is_told_once),
        cmocka_unit_test(second_signal_ends_the_process),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
