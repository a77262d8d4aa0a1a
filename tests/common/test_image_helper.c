#include "image_helper.h"
#include "interrupt.h"

#include <dirent.h>
#include <errno.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "report.h"

static char reported[8192];
static int reports;

static void keep_report(const char *line, void *user)
{
    (void)user;
    snprintf(reported, sizeof reported, "%s", line);
    reports++;
}

static void catch_reports(void)
{
    reports = 0;
    trip_report_redirect(keep_report, NULL);
}

static void assert_one_report(const char *text)
{
    trip_report_redirect(NULL, NULL);
    assert_int_equal(reports, 1);
    if (!strstr(reported, text))
        fail_msg("\"%s\" is not in: %s", text, reported);
}

/* Returns the only child of this process, or 0. */
static pid_t only_child(void)
{
    char path[64];
    int child = 0;
    snprintf(path, sizeof path, "/proc/self/task/%d/children", (int)getpid());
    FILE *f = fopen(path, "r");
    if (f && fscanf(f, "%d", &child) != 1)
        child = 0;
    if (f)
        fclose(f);
    return child;
}

static int count_descriptors(void)
{
    DIR *d = opendir("/proc/self/fd");
    int count = 0;
    while (d && readdir(d))
        count++;
    if (d)
        closedir(d);
    return count;
}

static void kinds_are_detected_by_content(void **state)
{
    (void)state;
    unsigned char dicom[132] = { 0 };
    memcpy(dicom + 128, "DICM", 4);
    assert_int_equal(trip_image_kind_of((const unsigned char *)"II*\0...", 8), TRIP_IMAGE_TIFF);
    assert_int_equal(trip_image_kind_of((const unsigned char *)"MM\0*...", 8), TRIP_IMAGE_TIFF);
    assert_int_equal(trip_image_kind_of((const unsigned char *)"\x89PNG\r\n\x1a\n", 8),
                     TRIP_IMAGE_PNG);
    assert_int_equal(trip_image_kind_of((const unsigned char *)"v/1\1....", 8), TRIP_IMAGE_EXR);
    assert_int_equal(trip_image_kind_of(dicom, 132), TRIP_IMAGE_DICOM);
    assert_int_equal(trip_image_kind_of(dicom, 131), TRIP_IMAGE_OTHER);
    assert_int_equal(trip_image_kind_of(dicom, 0), TRIP_IMAGE_OTHER);
}

static void one_helper_answers_several_requests(void **state)
{
    (void)state;
    trip_image_helper *h;
    uint64_t bytes;
    assert_int_equal(trip_image_helper_start(&h, "read"), 0);
    for (int n = 0; n < 3; n++) {
        catch_reports();
        assert_int_equal(
            trip_image_helper_request(h, TRIP_IMAGE_READ, "no-such-file.png", NULL, -1), 0);
        assert_int_equal(trip_image_helper_outcome(h, &bytes), TRIP_ERROR);
        assert_one_report("triptych: read: no-such-file.png: ");
    }
    trip_image_helper_stop(h);
    assert_int_equal(only_child(), 0);
}

static void a_helper_that_dies_is_a_reported_failure(void **state)
{
    (void)state;
    trip_image_helper *h;
    uint64_t bytes;
    int descriptors = count_descriptors();
    assert_int_equal(trip_image_helper_start(&h, "read"), 0);
    pid_t child = only_child();
    assert_true(child > 0);
    assert_int_equal(kill(child, SIGABRT), 0);
    catch_reports();
    int status = trip_image_helper_request(h, TRIP_IMAGE_READ, "deadly.tif", NULL, -1);
    if (status == 0)
        status = trip_image_helper_outcome(h, &bytes);
    assert_int_equal(status, TRIP_ERROR);
    assert_one_report("deadly.tif: crashed the decoder");
    catch_reports();
    assert_int_equal(trip_image_helper_request(h, TRIP_IMAGE_READ, "next.tif", NULL, -1),
                     TRIP_ERROR);
    assert_one_report("next.tif");
    trip_image_helper_stop(h);
    assert_int_equal(count_descriptors(), descriptors);
}

static void a_helper_ends_with_its_connection(void **state)
{
    (void)state;
    trip_image_helper *h;
    assert_int_equal(trip_image_helper_start(&h, "write"), 0);
    trip_image_helper_stop(h);
    assert_int_equal(only_child(), 0);
    trip_image_helper_stop(NULL);
}

/* Answer of a simulated helper. Then the helper stays silent if `stays` is set, or closes the
 * connection `fd`. */
static struct {
    unsigned char bytes[1 << 16];
    size_t count;
    bool stays;
    int fd;
} answer = { .fd = -1 };

static void add_bytes(const void *data, size_t bytes)
{
    assert_true(answer.count + bytes <= sizeof answer.bytes);
    memcpy(answer.bytes + answer.count, data, bytes);
    answer.count += bytes;
}

static void add_reply(uint32_t outcome, int32_t status, uint32_t text_bytes, uint64_t data_bytes)
{
    const trip_image_reply reply = { outcome, status, text_bytes, 0, data_bytes };
    add_bytes(&reply, sizeof reply);
}

static int answer_at_once(int fd)
{
    answer.fd = dup(fd);
    ssize_t n = send(answer.fd, answer.bytes, answer.count, MSG_NOSIGNAL);
    if (!answer.stays)
        shutdown(answer.fd, SHUT_WR);
    return n == (ssize_t)answer.count ? 0 : EIO;
}

static void begin_answer(bool stays)
{
    answer.count = 0;
    answer.stays = stays;
}

/* Sends a request to the simulated helper and returns the outcome. */
static int request(uint64_t *data_bytes)
{
    trip_image_helper *h;
    trip_image_helper_replace(answer_at_once, 150);
    assert_int_equal(trip_image_helper_start(&h, "read"), 0);
    catch_reports();
    int status = trip_image_helper_request(h, TRIP_IMAGE_READ, "some.tif", NULL, -1);
    if (status == 0)
        status = trip_image_helper_outcome(h, data_bytes);
    trip_report_redirect(NULL, NULL);
    trip_image_helper_stop(h);
    close(answer.fd);
    trip_image_helper_replace(NULL, 0);
    return status;
}

static void expect_distrust(const char *text)
{
    uint64_t bytes;
    assert_int_equal(request(&bytes), TRIP_ERROR);
    assert_one_report(text);
}

static void an_impossible_answer_is_a_reported_failure(void **state)
{
    (void)state;
    begin_answer(true);
    add_reply(77, 0, 0, 0);
    expect_distrust("some.tif: triptych-images sent an invalid reply: an unknown outcome");
    begin_answer(true);
    add_reply(TRIP_IMAGE_FAILED, 1, 0, 0);
    expect_distrust("an unknown status");
    begin_answer(true);
    add_reply(TRIP_IMAGE_FAILED, TRIP_INTERRUPTED, 0, 0);
    expect_distrust("an unknown status");
    begin_answer(true);
    add_reply(TRIP_IMAGE_DONE, 0, 4096, 0);
    expect_distrust("a text that is too long");
    begin_answer(true);
    add_reply(TRIP_IMAGE_WARNING, 0, 0, 1);
    expect_distrust("unexpected data");
}

static void the_number_of_warnings_is_limited(void **state)
{
    (void)state;
    begin_answer(true);
    for (int i = 0; i < 65; i++)
        add_reply(TRIP_IMAGE_WARNING, 0, 0, 0);
    uint64_t bytes;
    assert_int_equal(request(&bytes), TRIP_ERROR);
    assert_int_equal(reports, 65); /* 64 warnings and the failure */
    assert_non_null(strstr(reported, "too many warnings"));
}

static void signs_of_life_are_skipped(void **state)
{
    (void)state;
    uint64_t bytes = 0;
    begin_answer(true);
    for (int i = 0; i < 100; i++)
        add_reply(TRIP_IMAGE_WORKING, 0, 0, 0);
    add_reply(TRIP_IMAGE_DONE, 0, 0, 12345);
    assert_int_equal(request(&bytes), 0);
    assert_int_equal(reports, 0);
    assert_int_equal(bytes, 12345);
}

static void silence_and_an_early_end_are_reported_failures(void **state)
{
    (void)state;
    begin_answer(true);
    expect_distrust("some.tif: triptych-images has not answered for 0.15 s");
    begin_answer(true);
    add_bytes("half", 4);
    expect_distrust("has not answered");
    begin_answer(false);
    add_bytes("half", 4);
    expect_distrust("ended too early");
}

static void a_wait_for_a_silent_helper_ends_with_a_signal(void **state)
{
    (void)state;
    pid_t child = fork();
    if (child == 0) {
        trip_image_helper *h;
        uint64_t bytes;
        trip_interrupt_install();
        begin_answer(true);
        trip_image_helper_replace(answer_at_once, 1 << 30);
        catch_reports();
        int status = trip_image_helper_start(&h, "read");
        if (status == 0)
            status = trip_image_helper_request(h, TRIP_IMAGE_READ, "some.tif", NULL, -1);
        raise(SIGTERM);
        if (status == 0)
            status = trip_image_helper_outcome(h, &bytes);
        _exit(status == TRIP_INTERRUPTED && reports == 1 && strstr(reported, "interrupted") ? 0
                                                                                            : 1);
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

/* Starts a process that starts a helper and stops it with SIGSTOP. If `answered`, the helper
 * answers a request first. Returns the process. */
static pid_t stop_a_helper(bool answered, pid_t *helper)
{
    int pipes[2];
    assert_int_equal(prctl(PR_SET_CHILD_SUBREAPER, 1), 0);
    assert_int_equal(pipe(pipes), 0);
    pid_t parent = fork();
    if (parent == 0) {
        trip_image_helper *h;
        uint64_t bytes;
        trip_report_redirect(keep_report, NULL);
        int status = trip_image_helper_start(&h, "read");
        if (status == 0 && answered &&
            trip_image_helper_request(h, TRIP_IMAGE_READ, "none.png", NULL, -1) == 0)
            (void)trip_image_helper_outcome(h, &bytes);
        *helper = only_child();
        kill(*helper, SIGSTOP);
        (void)!write(pipes[1], helper, sizeof *helper);
        for (;;)
            pause();
    }
    assert_int_equal(read(pipes[0], helper, sizeof *helper), sizeof *helper);
    close(pipes[0]);
    close(pipes[1]);
    assert_true(*helper > 0);
    return parent;
}

/* A stopped helper cannot see that its connection has ended. The test stops helpers while they load
 * libraries, and later. */
static void a_helper_ends_with_its_killed_parent(void **state)
{
    (void)state;
    for (int answered = 0; answered < 2; answered++) {
        int status = 0;
        pid_t helper = 0, parent = stop_a_helper(answered, &helper), ended = 0;
        kill(parent, SIGKILL);
        assert_int_equal(waitpid(parent, &status, 0), parent);
        for (int ms = 0; ms < 20000 && ended == 0; ms++) {
            ended = waitpid(helper, &status, WNOHANG);
            nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
        }
        if (ended == 0)
            kill(helper, SIGKILL);
        assert_int_equal(ended, helper);
        assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kinds_are_detected_by_content),
        cmocka_unit_test(one_helper_answers_several_requests),
        cmocka_unit_test(a_helper_that_dies_is_a_reported_failure),
        cmocka_unit_test(a_helper_ends_with_its_connection),
        cmocka_unit_test(an_impossible_answer_is_a_reported_failure),
        cmocka_unit_test(the_number_of_warnings_is_limited),
        cmocka_unit_test(signs_of_life_are_skipped),
        cmocka_unit_test(silence_and_an_early_end_are_reported_failures),
        cmocka_unit_test(a_wait_for_a_silent_helper_ends_with_a_signal),
        cmocka_unit_test(a_helper_ends_with_its_killed_parent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
