#include "brick_files.h"

#include <fcntl.h>
#include <sys/stat.h>

#include "file_pieces.h"

enum { BYTES = 5 * 1024 * 1024 + 77 };

static unsigned char contents[BYTES], got[BYTES + 64];

/* Lies in the folder of the test program, because a file system in memory has no direct I/O. */
static char path[64];
static int fd;

static trip_file_pieces *open_pieces(void)
{
    uint64_t random = 5;
    for (size_t i = 0; i < BYTES; i++)
        contents[i] = (unsigned char)test_random(&random);
    strcpy(path, "pieces-XXXXXX");
    fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, contents, BYTES), BYTES);
    assert_int_equal(fsync(fd), 0);
    trip_file_pieces *p = trip_file_pieces_create(path, fd, BYTES);
    if (!p) {
        print_message("skipped: no direct I/O here\n");
        close(fd);
        unlink(path);
        skip();
    }
    return p;
}

static void close_pieces(trip_file_pieces *p)
{
    trip_file_pieces_destroy(p);
    close(fd);
    unlink(path);
}

static void any_part_is_read_from_memory_and_from_disk(void **state)
{
    (void)state;
    static const struct {
        size_t from, bytes;
    } parts[] = { { 0, BYTES },
                  { 0, 1 },
                  { BYTES - 1, 1 },
                  { 4095, 2 },
                  { 4096, 524288 },
                  { 1, 524288 },
                  { 524287, 1048577 },
                  { 12345, 3000000 },
                  { BYTES - 70000, 70000 },
                  { 1048576, 4096 },
                  { 2097151, 1048576 },
                  { 7, 0 } };
    trip_file_pieces *p = open_pieces();
    for (size_t i = 0; i < 2 * sizeof parts / sizeof *parts; i++) {
        size_t from = parts[i / 2].from, bytes = parts[i / 2].bytes;
        if (i % 2)
            assert_int_equal(posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED), 0);
        memset(got, 0xaa, sizeof got);
        assert_true(trip_file_pieces_read(p, from, got, bytes));
        assert_memory_equal(got, contents + from, bytes);
        assert_int_equal(got[bytes], 0xaa);
    }
    close_pieces(p);
}

static void recent_changes_are_read(void **state)
{
    (void)state;
    trip_file_pieces *p = open_pieces();
    unsigned char byte = (unsigned char)(contents[3000000] ^ 1);
    posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED);
    assert_int_equal(pwrite(fd, &byte, 1, 3000000), 1);
    assert_true(trip_file_pieces_read(p, 0, got, BYTES));
    assert_int_equal(got[3000000], byte);
    close_pieces(p);
}

static void a_file_that_became_shorter_is_not_read(void **state)
{
    (void)state;
    trip_file_pieces *p = open_pieces();
    assert_int_equal(ftruncate(fd, 1000000), 0);
    assert_false(trip_file_pieces_read(p, 0, got, BYTES));
    assert_false(trip_file_pieces_read(p, BYTES - 10, got, 20));
    close_pieces(p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_part_is_read_from_memory_and_from_disk),
        cmocka_unit_test(recent_changes_are_read),
        cmocka_unit_test(a_file_that_became_shorter_is_not_read),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
