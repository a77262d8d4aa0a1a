#include "test.h"
#include "interrupt.h"

#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

static void a_failure_is_one_line_with_stage_position_and_cause(void **state)
{
    (void)state;
    test_catch_reports();
    assert_int_equal(trip_fail(TRIP_USAGE, "read", "a.nrrd: line 3", "%d axes, not 3", 4),
                     TRIP_USAGE);
    assert_one_report("triptych: read: a.nrrd: line 3: 4 axes, not 3");
}

static void an_empty_position_is_left_out(void **state)
{
    (void)state;
    test_catch_reports();
    trip_fail(TRIP_ERROR, "memory", "", "none left");
    assert_one_report("triptych: memory: none left");
}

static void control_characters_are_escaped(void **state)
{
    (void)state;
    test_catch_reports();
    trip_fail(TRIP_ERROR, "read", "a\nb\x1b[31m", "%s",
              "c\td\x7f"
              "e\xc2\x85");
    assert_one_report("triptych: read: a\\nb\\x1b[31m: c\\td\\x7fe\\xc2\\x85");
}

static void letters_outside_ascii_stay(void **state)
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

static void bad_utf8_and_direction_marks_are_escaped(void **state)
{
    (void)state;
    test_catch_reports();
    trip_fail(TRIP_ERROR, "read", "a\xff\xc3(", "\xe2\x80\xae%s\xed\xa0\x80\xc0\xaf\xe2\x82", "b");
    assert_one_report("triptych: read: a\\xff\\xc3(: \\xe2\\x80\\xaeb\\xed\\xa0\\x80\\xc0\\xaf"
                      "\\xe2\\x82");
}

static void a_line_is_cut_between_characters(void **state)
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

static void a_line_that_is_too_long_is_cut_and_marked(void **state)
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

static void reporting_does_not_change_errno(void **state)
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
    trip_interrupt_install();
    raise(SIGHUP);
    assert_true(trip_interrupted());
    trip_interrupt_install();
    raise(SIGQUIT);
    assert_true(trip_interrupted());
    trip_interrupt_install();
}

static void an_ignored_hangup_stays_ignored(void **state)
{
    (void)state;
    static const int ignored[] = { SIGHUP, SIGQUIT };
    for (int i = 0; i < 2; i++) {
        signal(ignored[i], SIG_IGN);
        trip_interrupt_install();
        raise(ignored[i]);
        assert_false(trip_interrupted());
        raise(SIGINT);
        raise(ignored[i]);
        assert_true(trip_interrupted());
        trip_interrupt_install();
        signal(ignored[i], SIG_DFL);
    }
}

/* Writes to a pipe without a reader, and returns the error of the write. */
static int write_unread(int fd)
{
    int ends[2], keep = dup(fd);
    assert_int_equal(pipe(ends), 0);
    dup2(ends[1], fd);
    close(ends[0]);
    close(ends[1]);
    const int error = write(fd, "x", 1) < 0 ? errno : 0;
    assert_true(trip_interrupt_is_unread(fd));
    dup2(keep, fd);
    close(keep);
    return error;
}

static void a_pipe_without_a_reader_ends_only_programs_that_print_their_results(void **state)
{
    (void)state;
    fflush(stdout);
    trip_interrupt_install();
    assert_int_equal(write_unread(STDOUT_FILENO), EPIPE);
    assert_false(trip_interrupted());
    trip_interrupt_at_end_of_output();
    assert_int_equal(write_unread(STDERR_FILENO), EPIPE);
    assert_false(trip_interrupted());
    assert_int_equal(write_unread(STDOUT_FILENO), EPIPE);
    assert_true(trip_interrupted());
    trip_interrupt_install();
}

static void a_signal_interrupts_only_scopes_that_heed_its_flag(void **state)
{
    (void)state;
    volatile sig_atomic_t flag = 0;
    trip_scope heeding = { 0 }, inner = { .around = &heeding }, other = { 0 };
    trip_scope *before = trip_scope_enter(&inner);
    trip_scope_heed(&flag);
    assert_ptr_equal(trip_scope_signal(), &flag);
    assert_false(trip_interrupted());
    flag = 1;
    assert_true(trip_interrupted());
    trip_scope_enter(&other);
    assert_null(trip_scope_signal());
    assert_false(trip_interrupted());
    trip_scope_enter(before);
}

static void an_interrupt_is_reported_once(void **state)
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

static void take_failure(void *user, int status, const char *line)
{
    snprintf(user, 64, "%d %.50s", status, line);
}

static void take_line(const char *line, void *user)
{
    snprintf(user, 64, "%.60s", line);
}

static void a_scope_gets_only_the_lines_of_its_threads(void **state)
{
    (void)state;
    char text[64] = "";
    trip_scope s = { .sink = take_line, .user = text };
    test_catch_reports();
    trip_scope *before = trip_scope_enter(&s);
    trip_warn("a", "inside");
    assert_string_equal(text, "triptych: warning: a: inside");
    trip_scope_enter(before);
    trip_warn("a", "outside");
    assert_string_equal(text, "triptych: warning: a: inside");
    assert_one_report("triptych: warning: a: outside");
}

static void a_scope_for_failures_passes_other_lines_outwards(void **state)
{
    (void)state;
    char text[64] = "";
    trip_scope s = { .around = trip_scope_current(), .failed = take_failure, .user = text };
    test_catch_reports();
    trip_scope *before = trip_scope_enter(&s);
    trip_fail(TRIP_USAGE, "a", "b", "wrong");
    trip_warn("a", "odd");
    trip_scope_enter(before);
    assert_string_equal(text, "-2 triptych: a: b: wrong");
    assert_one_report("triptych: warning: a: odd");
}

static void a_held_failure_is_reported_when_it_is_printed(void **state)
{
    (void)state;
    char text[64] = "";
    trip_held_report h;
    trip_scope s = { .failed = take_failure, .user = text };
    trip_scope *before = trip_scope_enter(&s);
    trip_report_hold(&h);
    trip_fail(TRIP_ERROR, "a", "b", "first");
    trip_fail(TRIP_ERROR, "a", "b", "second");
    trip_report_release(&h);
    assert_string_equal(text, "");
    trip_report_print(&h);
    trip_scope_enter(before);
    assert_string_equal(text, "-1 triptych: a: b: first");
}

/* Returns whether a thread in this scope should continue its work. */
static bool should_continue_in(trip_scope *s)
{
    trip_scope *before = trip_scope_enter(s);
    bool wanted = !trip_interrupted();
    trip_scope_enter(before);
    return wanted;
}

static void cancelling_a_scope_includes_inner_scopes(void **state)
{
    (void)state;
    trip_scope outer = { 0 }, inner = { .around = &outer }, other = { 0 };
    trip_scope_cancel(&inner);
    assert_false(should_continue_in(&inner));
    assert_true(should_continue_in(&outer));
    assert_true(should_continue_in(&other));
    trip_scope_renew(&inner);
    assert_true(should_continue_in(&inner));
    trip_scope_cancel(&outer);
    assert_false(should_continue_in(&inner));
    assert_true(should_continue_in(&other));
    assert_false(trip_interrupted());
}

static void a_cancelled_scope_reports_one_interrupt(void **state)
{
    (void)state;
    trip_scope s = { .around = trip_scope_current() };
    trip_scope_cancel(&s);
    test_catch_reports();
    trip_scope *before = trip_scope_enter(&s);
    trip_fail(TRIP_INTERRUPTED, "render", "frame", "interrupted");
    trip_fail(TRIP_INTERRUPTED, "read", "a.trip", "interrupted");
    trip_scope_enter(before);
    assert_one_report("triptych: render: frame: interrupted");
}

static void pass_on(const char *line, void *user)
{
    ++*(int *)user;
    trip_report_line(line);
}

static void the_sink_of_the_outermost_scope_may_report(void **state)
{
    (void)state;
    int lines = 0;
    assert_null(trip_scope_current()->around);
    trip_report_redirect(pass_on, &lines);
    trip_warn("a", "b"); /* printed on stderr */
    trip_report_redirect(NULL, NULL);
    assert_int_equal(lines, 1);
}

typedef struct counter {
    trip_scope scope;
    int count, foreign;
} counter;

static void *warn_in(void *scope)
{
    trip_scope_enter(scope);
    for (int i = 0; i < 1000; i++)
        trip_warn("a", "%p", scope);
    return NULL;
}

static void count_own(const char *line, void *user)
{
    counter *c = user;
    char own[64];
    snprintf(own, sizeof own, "triptych: warning: a: %p", user);
    *(strcmp(line, own) ? &c->foreign : &c->count) += 1;
}

static void threads_in_different_scopes_are_independent(void **state)
{
    (void)state;
    counter counters[2] = { { .count = 0 }, { .count = 0 } };
    pthread_t threads[2];
    for (int i = 0; i < 2; i++) {
        counters[i].scope = (trip_scope){ .sink = count_own, .user = &counters[i] };
        assert_int_equal(pthread_create(&threads[i], NULL, warn_in, &counters[i].scope), 0);
    }
    for (int i = 0; i < 2; i++) {
        pthread_join(threads[i], NULL);
        assert_int_equal(counters[i].count, 1000);
        assert_int_equal(counters[i].foreign, 0);
    }
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
        cmocka_unit_test(a_failure_is_one_line_with_stage_position_and_cause),
        cmocka_unit_test(an_empty_position_is_left_out),
        cmocka_unit_test(control_characters_are_escaped),
        cmocka_unit_test(letters_outside_ascii_stay),
        cmocka_unit_test(bad_utf8_and_direction_marks_are_escaped),
        cmocka_unit_test(a_line_is_cut_between_characters),
        cmocka_unit_test(a_line_that_is_too_long_is_cut_and_marked),
        cmocka_unit_test(errno_text_follows_the_action),
        cmocka_unit_test(reporting_does_not_change_errno),
        cmocka_unit_test(without_a_sink_lines_go_to_stderr),
        cmocka_unit_test(first_signal_sets_a_flag),
        cmocka_unit_test(an_ignored_hangup_stays_ignored),
        cmocka_unit_test(a_pipe_without_a_reader_ends_only_programs_that_print_their_results),
        cmocka_unit_test(a_signal_interrupts_only_scopes_that_heed_its_flag),
        cmocka_unit_test(an_interrupt_is_reported_once),
        cmocka_unit_test(a_scope_gets_only_the_lines_of_its_threads),
        cmocka_unit_test(a_scope_for_failures_passes_other_lines_outwards),
        cmocka_unit_test(a_held_failure_is_reported_when_it_is_printed),
        cmocka_unit_test(cancelling_a_scope_includes_inner_scopes),
        cmocka_unit_test(a_cancelled_scope_reports_one_interrupt),
        cmocka_unit_test(the_sink_of_the_outermost_scope_may_report),
        cmocka_unit_test(threads_in_different_scopes_are_independent),
        cmocka_unit_test(second_signal_ends_the_process),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
