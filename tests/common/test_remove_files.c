/* Tests that files are removed by name. A process of its own frees large files. It is no child of
 * the caller and keeps no other file open. */
#include "remove_files.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include "scope.h"
#include "test.h"

static char folder_name[] = "/tmp/trip-remove-XXXXXX";
static int folder;

static int make_folder(void **state)
{
    (void)state;
    strcpy(strrchr(folder_name, '-'), "-XXXXXX");
    if (!mkdtemp(folder_name))
        return -1;
    folder = open(folder_name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    return folder < 0;
}

static int drop_folder(void **state)
{
    (void)state;
    close(folder);
    return rmdir(folder_name);
}

static bool starts_with_a(const char *name)
{
    return name[0] == 'a';
}

static bool is_there(const char *name)
{
    return faccessat(folder, name, F_OK, AT_SYMLINK_NOFOLLOW) == 0;
}

static void make_file(const char *name, off_t bytes)
{
    int fd = openat(folder, name, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    assert_true(fd >= 0);
    assert_true(bytes == 0 || posix_fallocate(fd, 0, bytes) == 0);
    close(fd);
}

/* Makes files too large to be freed by the caller itself. */
static void make_large_files(void)
{
    make_file("a1", TRIP_REMOVE_APART_BYTES / 2 + 4096);
    make_file("a2", TRIP_REMOVE_APART_BYTES / 2 + 4096);
}

static void only_the_named_files_are_removed(void **state)
{
    (void)state;
    make_file("a", 0);
    make_file("b", 5000);
    assert_int_equal(symlinkat("b", folder, "a-link"), 0);
    trip_remove_files(folder, starts_with_a);
    assert_false(is_there("a") || is_there("a-link"));
    assert_true(is_there("b"));
    assert_int_equal(unlinkat(folder, "b", 0), 0);
}

static void large_files_are_removed_and_leave_no_child(void **state)
{
    (void)state;
    make_large_files();
    trip_remove_files(folder, starts_with_a);
    assert_false(is_there("a1") || is_there("a2"));
    assert_int_equal(waitpid(-1, NULL, __WALL | WNOHANG), -1);
    assert_int_equal(errno, ECHILD);
}

/* The process that frees the files may still run after the call returns. */
static void files_of_the_caller_do_not_stay_open(void **state)
{
    (void)state;
    int ends[2];
    char byte;
    trip_scope scope = { .around = trip_scope_current() };
    make_large_files();
    assert_int_equal(pipe(ends), 0);
    int locked = openat(folder, ".", O_RDONLY | O_DIRECTORY);
    assert_int_equal(flock(locked, LOCK_EX | LOCK_NB), 0);

    trip_scope *before = trip_scope_enter(&scope);
    trip_scope_cancel(&scope);
    trip_remove_files(folder, starts_with_a);
    trip_scope_enter(before);

    assert_false(is_there("a1") || is_there("a2"));
    close(ends[1]);
    struct pollfd at_end = { .fd = ends[0], .events = POLLIN };
    assert_int_equal(poll(&at_end, 1, 0), 1);
    assert_int_equal(read(ends[0], &byte, 1), 0);
    close(ends[0]);
    close(locked);
    locked = openat(folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    assert_int_equal(flock(locked, LOCK_EX | LOCK_NB), 0);
    close(locked);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(only_the_named_files_are_removed, make_folder, drop_folder),
        cmocka_unit_test_setup_teardown(large_files_are_removed_and_leave_no_child, make_folder,
                                        drop_folder),
        cmocka_unit_test_setup_teardown(files_of_the_caller_do_not_stay_open, make_folder,
                                        drop_folder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
