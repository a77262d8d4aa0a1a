/* Tests memory limits in a temporary folder that stands in for the root of the file system. */
#include "test.h"

#include "memory_limits.h"

#include <sys/stat.h>
#include <unistd.h>

static char root[64];

static int make_root(void **state)
{
    (void)state;
    strcpy(root, "/tmp/trip_limits_XXXXXX");
    return mkdtemp(root) ? 0 : -1;
}

static int remove_root(void **state)
{
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", root);
    return system(command);
}

/* Writes `text` to root/path. Creates missing folders. */
static void write_below_root(const char *path, const char *text)
{
    char full[256];
    snprintf(full, sizeof full, "%s/%s", root, path);
    for (char *p = full + strlen(root) + 1; (p = strchr(p, '/')); p++) {
        *p = 0;
        mkdir(full, 0777);
        *p = '/';
    }
    FILE *f = fopen(full, "w");
    assert_non_null(f);
    fputs(text, f);
    fclose(f);
}

static void no_control_groups_mean_no_limit(void **state)
{
    (void)state;
    assert_true(trip_cgroup_limit_bytes(root) == UINT64_MAX);
}

static void version_2_limit_of_the_group_counts(void **state)
{
    (void)state;
    write_below_root("proc/self/cgroup", "0::/a/b\n");
    write_below_root("sys/fs/cgroup/a/b/memory.max", "1000000\n");
    write_below_root("sys/fs/cgroup/a/memory.max", "max\n");
    assert_true(trip_cgroup_limit_bytes(root) == 1000000);
}

static void a_smaller_limit_of_a_parent_group_counts(void **state)
{
    (void)state;
    write_below_root("proc/self/cgroup", "0::/a/b\n");
    write_below_root("sys/fs/cgroup/a/b/memory.max", "1000000\n");
    write_below_root("sys/fs/cgroup/a/memory.max", "5000\n");
    assert_true(trip_cgroup_limit_bytes(root) == 5000);
}

static void a_group_that_is_not_mounted_has_the_limit_of_the_root(void **state)
{
    (void)state;
    write_below_root("proc/self/cgroup", "0::/machine/outside\n");
    write_below_root("sys/fs/cgroup/memory.max", "70000\n");
    assert_true(trip_cgroup_limit_bytes(root) == 70000);
}

static void version_1_limit_of_the_memory_controller_counts(void **state)
{
    (void)state;
    write_below_root("proc/self/cgroup",
                     "9:name=systemd:/\n4:cpu,memory:/x\n3:memory_other:/y\n0::/\n");
    write_below_root("sys/fs/cgroup/memory/x/memory.limit_in_bytes", "4096000\n");
    write_below_root("sys/fs/cgroup/memory/y/memory.limit_in_bytes", "1\n");
    write_below_root("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
    assert_true(trip_cgroup_limit_bytes(root) == 4096000);
}

static void malformed_files_mean_no_limit(void **state)
{
    (void)state;
    write_below_root("proc/self/cgroup", "nonsense\n\n::\n0::\n4:memory:\n");
    write_below_root("sys/fs/cgroup/memory.max", "abc\n");
    assert_true(trip_cgroup_limit_bytes(root) == UINT64_MAX);
}

static void a_field_in_proc_is_found_by_its_whole_name(void **state)
{
    (void)state;
    char path[256];
    write_below_root("status", "VmHWMx:\t 7 kB\nVmHWM:\t  1234 kB\nVmRSS:\t 5 kB\n");
    snprintf(path, sizeof path, "%s/status", root);
    assert_true(trip_proc_field_bytes(path, "VmHWM") == 1234 * 1024);
    assert_true(trip_proc_field_bytes(path, "VmPeak") == 0);
    assert_true(trip_proc_field_bytes("/nowhere", "VmHWM") == 0);
}

#define WITH_ROOT(test) cmocka_unit_test_setup_teardown(test, make_root, remove_root)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH_ROOT(no_control_groups_mean_no_limit),
        WITH_ROOT(version_2_limit_of_the_group_counts),
        WITH_ROOT(a_smaller_limit_of_a_parent_group_counts),
        WITH_ROOT(a_group_that_is_not_mounted_has_the_limit_of_the_root),
        WITH_ROOT(version_1_limit_of_the_memory_controller_counts),
        WITH_ROOT(malformed_files_mean_no_limit),
        WITH_ROOT(a_field_in_proc_is_found_by_its_whole_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
