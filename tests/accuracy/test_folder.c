/* Tests the folder of a report. It gets its name when it is complete, replaces only reports, and
 * leaves nothing if it is abandoned. */
#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include "accuracy_report.h"
#include "test.h"

static void write_file(const char *path)
{
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    fputs("text", f);
    assert_int_equal(fclose(f), 0);
}

static void write_in(const accuracy_folder *f, const char *name)
{
    char path[PATH_MAX + 32];
    snprintf(path, sizeof path, "%s/%s", f->temporary, name);
    write_file(path);
}

/* Returns how many entries of the current folder begin with `name`. */
static int count_folders(const char *name)
{
    int count = 0;
    DIR *here = opendir(".");
    assert_non_null(here);
    for (struct dirent *e; (e = readdir(here));)
        count += !strncmp(e->d_name, name, strlen(name));
    closedir(here);
    return count;
}

static void a_report_gets_its_name_when_it_is_complete(void **state)
{
    (void)state;
    accuracy_folder f;
    assert_int_equal(accuracy_folder_begin(&f, "fresh/", false), 0);
    assert_int_not_equal(access("fresh", F_OK), 0);
    write_in(&f, "accuracy.json");
    assert_int_equal(accuracy_folder_finish(&f), 0);
    accuracy_folder_abandon(&f);
    assert_int_equal(access("fresh/accuracy.json", F_OK), 0);
    assert_int_equal(count_folders("fresh"), 1);
}

static void a_report_replaces_a_report_if_forced(void **state)
{
    (void)state;
    accuracy_folder f;
    test_catch_reports();
    assert_int_equal(accuracy_folder_begin(&f, "fresh", false), TRIP_ERROR);
    assert_one_report("--force");
    assert_int_equal(accuracy_folder_begin(&f, "fresh", true), 0);
    write_in(&f, "index.html");
    assert_int_equal(accuracy_folder_finish(&f), 0);
    assert_int_equal(access("fresh/index.html", F_OK), 0);
    assert_int_not_equal(access("fresh/accuracy.json", F_OK), 0);
    assert_int_equal(count_folders("fresh"), 1);
}

static void files_and_folders_that_are_no_report_stay(void **state)
{
    (void)state;
    accuracy_folder f;
    assert_int_equal(mkdir("other", 0777), 0);
    write_file("other/accuracy.json");
    write_file("other/letter.txt");
    test_catch_reports();
    assert_int_equal(accuracy_folder_begin(&f, "other", true), TRIP_ERROR);
    assert_one_report("is not a report");
    write_file("file");
    test_catch_reports();
    assert_int_equal(accuracy_folder_begin(&f, "file", true), TRIP_ERROR);
    assert_one_report("is not a report");
    assert_int_equal(access("other/letter.txt", F_OK), 0);
}

static void an_abandoned_report_leaves_nothing(void **state)
{
    (void)state;
    accuracy_folder f;
    assert_int_equal(accuracy_folder_begin(&f, "given-up", false), 0);
    write_in(&f, "accuracy.csv");
    write_in(&f, "truth-0.exr");
    accuracy_folder_abandon(&f);
    assert_int_equal(count_folders("given-up"), 0);
    test_catch_reports();
    assert_int_equal(accuracy_folder_begin(&f, "missing/report", false), TRIP_ERROR);
    assert_one_report("cannot create");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_report_gets_its_name_when_it_is_complete),
        cmocka_unit_test(a_report_replaces_a_report_if_forced),
        cmocka_unit_test(files_and_folders_that_are_no_report_stay),
        cmocka_unit_test(an_abandoned_report_leaves_nothing),
    };
    char folder[] = "/tmp/triptych-folder-XXXXXX";
    if (!mkdtemp(folder) || chdir(folder))
        return 1;
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    return system("rm -rf -- \"$PWD\"") || failed;
}
