#include "new_file.h"

#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include "test.h"

static char folder[] = "new_file-XXXXXX";

static int enter_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? chdir(folder) : -1;
}

static int leave_folder(void **state)
{
    (void)state;
    return chdir("..") == 0 ? rmdir(folder) : -1;
}

static int count_files(void)
{
    DIR *d = opendir(".");
    int count = -2;
    while (readdir(d))
        count++;
    closedir(d);
    return count;
}

static void write_new(const char *path, const char *text)
{
    trip_new_file f;
    assert_int_equal(trip_new_file_begin(&f, "write", path), 0);
    assert_int_equal(write(f.fd, text, strlen(text)), strlen(text));
    assert_int_equal(trip_new_file_finish(&f), 0);
}

static void assert_holds(const char *path, const char *text)
{
    char read_back[64] = "";
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    assert_int_equal(fread(read_back, 1, 63, f), strlen(text));
    fclose(f);
    assert_string_equal(read_back, text);
}

static void a_file_appears_when_it_is_finished(void **state)
{
    (void)state;
    trip_new_file f;
    assert_int_equal(trip_new_file_begin(&f, "write", "a"), 0);
    assert_int_not_equal(access("a", F_OK), 0);
    trip_new_file_abandon(&f);
    trip_new_file_abandon(&f);
    assert_int_equal(count_files(), 0);
    write_new("a", "one");
    assert_holds("a", "one");
    assert_int_equal(unlink("a"), 0);
    assert_int_equal(count_files(), 0);
}

static void a_replaced_file_stays_until_the_end_and_passes_on_its_mode(void **state)
{
    (void)state;
    struct stat st;
    trip_new_file f;
    write_new("a", "one");
    assert_int_equal(chmod("a", 0600), 0);
    assert_int_equal(trip_new_file_begin(&f, "write", "a"), 0);
    trip_new_file_abandon(&f);
    assert_holds("a", "one");
    write_new("a", "two");
    assert_holds("a", "two");
    assert_int_equal(stat("a", &st), 0);
    assert_int_equal(st.st_mode & 0777, 0600);
    unlink("a");
}

static void a_link_is_replaced_and_its_target_stays(void **state)
{
    (void)state;
    struct stat st;
    write_new("goal", "one");
    assert_int_equal(symlink("goal", "link"), 0);
    write_new("link", "two");
    assert_holds("goal", "one");
    assert_int_equal(lstat("link", &st), 0);
    assert_true(S_ISREG(st.st_mode));
    unlink("goal");
    unlink("link");
}

/* Other processes may have the device or pipe open, and would lose their connection. */
static void a_device_or_a_pipe_is_not_replaced(void **state)
{
    (void)state;
    trip_new_file f;
    struct stat st;
    assert_int_equal(mkfifo("pipe", 0600), 0);
    assert_int_equal(symlink("/proc/self/fd/1", "output"), 0);
    const char *const paths[] = { "pipe", "output", "/dev/null" };
    for (int i = 0; i < 3; i++) {
        test_catch_reports();
        assert_int_equal(trip_new_file_begin(&f, "write", paths[i]), TRIP_ERROR);
        assert_one_report("is a device, a pipe or a socket");
        test_catch_reports();
        assert_int_equal(trip_new_file_check("write", paths[i]), TRIP_ERROR);
        assert_one_report("is a device, a pipe or a socket");
    }
    assert_int_equal(lstat("pipe", &st), 0);
    assert_true(S_ISFIFO(st.st_mode));
    unlink("pipe");
    unlink("output");
    assert_int_equal(count_files(), 0);
}

static void a_text_is_written_completely_or_not_at_all(void **state)
{
    (void)state;
    assert_int_equal(trip_new_file_of_text("write", "a", "one\n"), 0);
    assert_holds("a", "one\n");
    assert_int_equal(trip_new_file_of_text("write", "a", ""), 0);
    assert_holds("a", "");
    unlink("a");
    test_catch_reports();
    assert_int_equal(trip_new_file_of_text("keep", "missing/a", "one"), TRIP_ERROR);
    assert_one_report("keep: missing/a: cannot create a file beside it");
    assert_int_equal(count_files(), 0);
}

static void temporaries_of_one_file_have_different_names(void **state)
{
    (void)state;
    trip_new_file one, two;
    assert_int_equal(trip_new_file_begin(&one, "write", "a"), 0);
    assert_int_equal(trip_new_file_begin(&two, "write", "a"), 0);
    assert_string_not_equal(one.temporary, two.temporary);
    trip_new_file_abandon(&one);
    trip_new_file_abandon(&two);
}

static void a_failed_write_is_one_report_and_leaves_nothing(void **state)
{
    (void)state;
    trip_new_file f;
    test_catch_reports();
    assert_int_equal(trip_new_file_begin(&f, "write", "missing/a"), TRIP_ERROR);
    assert_one_report("missing/a: cannot create a file beside it: No such file");
    assert_int_equal(mkdir("a", 0777), 0);
    assert_int_equal(trip_new_file_begin(&f, "write", "a"), 0);
    test_catch_reports();
    assert_int_equal(trip_new_file_finish(&f), TRIP_ERROR);
    assert_one_report("a: cannot write: Is a directory");
    assert_int_equal(rmdir("a"), 0);
    assert_int_equal(count_files(), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_file_appears_when_it_is_finished),
        cmocka_unit_test(a_replaced_file_stays_until_the_end_and_passes_on_its_mode),
        cmocka_unit_test(a_link_is_replaced_and_its_target_stays),
        cmocka_unit_test(a_device_or_a_pipe_is_not_replaced),
        cmocka_unit_test(a_text_is_written_completely_or_not_at_all),
        cmocka_unit_test(temporaries_of_one_file_have_different_names),
        cmocka_unit_test(a_failed_write_is_one_report_and_leaves_nothing),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
