#include "file_path.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include "test.h"

static char folder[] = "path-XXXXXX";

static int enter_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder) || chdir(folder))
        return -1;
    FILE *f = mkdir("in", 0777) || mkdir("in/deep", 0777) || mkdir("out", 0777) ||
                      symlink("in/deep", "link")
                  ? NULL
                  : fopen("in/v", "w");
    return f ? fclose(f) : -1;
}

static int leave_folder(void **state)
{
    (void)state;
    return remove("in/v") || remove("in/deep") || remove("in") || remove("out") || remove("link") ||
           chdir("..") || rmdir(folder);
}

static void check(char *path, const char *expected)
{
    assert_non_null(path);
    assert_string_equal(path, expected);
    free(path);
}

static void a_relative_path_leads_from_one_file_to_another(void **state)
{
    (void)state;
    check(trip_path_relative("a", "b"), "b");
    check(trip_path_relative("out/a", "in/v"), "../in/v");
    check(trip_path_relative("a", "in/v"), "in/v");
    check(trip_path_relative("in/deep/a", "v"), "../../v");
    check(trip_path_relative("out/../in/a", "./in/v"), "v");
    check(trip_path_relative("link/a", "in/v"), "../v");
    assert_null(trip_path_relative("missing/a", "b"));
}

static void a_path_beside_a_file_is_short_and_leads_to_the_same_file(void **state)
{
    (void)state;
    check(trip_path_beside("a", "in/v"), "in/v");
    check(trip_path_beside("out/a", "../in/v"), "in/v");
    check(trip_path_beside("out/a/", "../in/v"), "in/v");
    check(trip_path_beside("in/deep/a", "../../in/v"), "in/v");
    check(trip_path_beside("out/a", "/v"), "/v");
    check(trip_path_beside("link/a", "../v"), "link/../v"); /* the link leads to in/deep */
    check(trip_path_beside("out/a", "../in/missing"), "out/../in/missing");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_relative_path_leads_from_one_file_to_another),
        cmocka_unit_test(a_path_beside_a_file_is_short_and_leads_to_the_same_file),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
