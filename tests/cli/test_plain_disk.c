/* Tests the plain reads with which the speed of a disk is measured. */
#include "plain_disk.h"

#include <fcntl.h>
#include <unistd.h>

#include "report.h"
#include "test.h"

enum { BYTES = 3 * PLAIN_DISK_TRANSFER_BYTES };

static char path[] = "plain_disk-XXXXXX";

static int make_file(void **state)
{
    int fd = mkstemp(path);
    if (fd < 0 || ftruncate(fd, BYTES) < 0)
        return -1;
    close(fd);
    *state = aligned_alloc(4096, PLAIN_DISK_MEMORY_BYTES);
    return *state ? 0 : -1;
}

static int remove_file(void **state)
{
    free(*state);
    return unlink(path);
}

static void a_file_is_read_completely(void **state)
{
    plain_disk d = { .look = true };
    assert_int_equal(plain_disk_read(&d, path, *state), 0);
    assert_int_equal(d.bytes, BYTES);
}

static void a_cancelled_read_ends_before_the_end_of_the_file(void **state)
{
    plain_disk d = { .look = true };
    trip_scope scope = { .around = trip_scope_current() };
    test_catch_reports();
    trip_scope *before = trip_scope_enter(&scope);
    trip_scope_cancel(&scope);
    assert_int_equal(plain_disk_read(&d, path, *state), TRIP_INTERRUPTED);
    trip_scope_enter(before);
    assert_int_equal(d.bytes, 0);
    assert_one_report("interrupted");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_file_is_read_completely),
        cmocka_unit_test(a_cancelled_read_ends_before_the_end_of_the_file),
    };
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
