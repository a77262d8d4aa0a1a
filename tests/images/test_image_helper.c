#include "image_helper.h"

#include <dirent.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
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

/* The only child of this process, or 0. */
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

static void kinds_are_told_by_content(void **state)
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

static void one_helper_answers_request_after_request(void **state)
{
    (void)state;
    trip_image_helper *h;
    uint64_t bytes;
    assert_int_equal(trip_image_helper_start(&h, "read"), 0);
    for (int n = 0; n < 3; n++) {
        catch_reports();
        assert_int_equal(trip_image_helper_request(h, TRIP_IMAGE_READ, "no-such-file.png", NULL),
                         0);
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
    int status = trip_image_helper_request(h, TRIP_IMAGE_READ, "deadly.tif", NULL);
    if (status == 0)
        status = trip_image_helper_outcome(h, &bytes);
    assert_int_equal(status, TRIP_ERROR);
    assert_one_report("deadly.tif: brought the decoder down");
    catch_reports();
    assert_int_equal(trip_image_helper_request(h, TRIP_IMAGE_READ, "next.tif", NULL), TRIP_ERROR);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kinds_are_told_by_content),
        cmocka_unit_test(one_helper_answers_request_after_request),
        cmocka_unit_test(a_helper_that_dies_is_a_reported_failure),
        cmocka_unit_test(a_helper_ends_with_its_connection),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
