#include "disk_time.h"

#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <unistd.h>

#include "skips.h"
#include "test.h"

/* A disk of 100 MB/s. */
static const double per_byte = 1e-8;

static double seconds(uint64_t uncached, uint64_t cache, int passes, double compute)
{
    return trip_disk_time_read(&(trip_read_cost){ .bytes = 1000000000,
                                                  .uncached_bytes = uncached,
                                                  .cache_bytes = cache,
                                                  .seconds_per_byte = per_byte,
                                                  .compute_seconds = compute,
                                                  .passes = passes });
}

static void reading_takes_the_time_of_the_disk_or_of_computing(void **state)
{
    (void)state;
    const uint64_t all = 1000000000;
    assert_true(fabs(seconds(0, 2 * all, 2, 3) - 3) < 1e-9); /* all is in the page cache */
    assert_true(fabs(seconds(all, 2 * all, 1, 3) - 10) < 1e-9);
    assert_true(fabs(seconds(all, 2 * all, 2, 3) - 10) < 1e-9); /* the cache keeps it */
    assert_true(fabs(seconds(all, all / 2, 2, 3) - 20) < 1e-9); /* the disk reads it twice */
    assert_true(fabs(seconds(all / 4, 2 * all, 2, 3) - 3) < 1e-9);
    assert_true(fabs(seconds(all, all / 2, 2, 50) - 50) < 1e-9);
}

static void only_dropped_pages_count_as_uncached(void **state)
{
    (void)state;
    enum { BYTES = 1 << 20 };
    char path[] = "disk_time-XXXXXX";
    char *data = calloc(1, BYTES);
    int fd = mkstemp(path);
    assert_true(data && fd >= 0);
    assert_int_equal(write(fd, data, BYTES), BYTES);
    assert_int_equal(trip_disk_time_uncached(path), 0);
    assert_int_equal(fsync(fd), 0);
    assert_int_equal(posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED), 0);
    const uint64_t dropped = trip_disk_time_uncached(path);
    assert_in_range(dropped, 0, BYTES);
    close(fd);
    remove(path);
    free(data);
    assert_int_equal(trip_disk_time_uncached(path), 0); /* the file is gone */
    if (dropped < BYTES / 2)
        test_lacks("a file system that drops cached pages");
}

static void missing_files_have_no_speed(void **state)
{
    (void)state;
    assert_true(trip_disk_time_reading("missing") == 0);
    assert_true(trip_disk_time_writing("./new") > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reading_takes_the_time_of_the_disk_or_of_computing),
        cmocka_unit_test(only_dropped_pages_count_as_uncached),
        cmocka_unit_test(missing_files_have_no_speed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
