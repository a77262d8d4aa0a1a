#include "sandbox.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/fs.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <spawn.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test.h"

static char folder[] = "sandbox-XXXXXX";
enum { NO_SANDBOX = 99 };

static int enter_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder) || chdir(folder) != 0)
        return -1;
    FILE *f = fopen("there", "w");
    return f && fputs("text", f) >= 0 ? fclose(f) : -1;
}

static int leave_folder(void **state)
{
    (void)state;
    return unlink("there") == 0 && chdir("..") == 0 ? rmdir(folder) : -1;
}

/* Runs `act` in a sandboxed child. Returns the wait status of the child. */
static int run_inside(int (*act)(void))
{
    int status = 0;
    pid_t child = fork();
    if (child == 0)
        _exit(trip_sandbox_enter() ? act() : NO_SANDBOX);
    assert_int_equal(waitpid(child, &status, 0), child);
    if (WIFEXITED(status) && WEXITSTATUS(status) == NO_SANDBOX) {
        print_message("skipped: this kernel filters no system calls\n");
        skip();
    }
    return status;
}

static bool refused(long result)
{
    return result < 0 && errno == EPERM;
}

/* Tries denied system calls. Returns the number of the first call that is not refused, or 0. */
static int try_denied_calls(void)
{
    char *argv[] = { (char[]){ "true" }, NULL };
    pid_t pid;
    int there = open("there", O_RDONLY), flags[16] = { 0 };
    const bool all[] = {
        refused(execve("/bin/true", argv, environ)),
        posix_spawn(&pid, "/bin/true", NULL, NULL, argv, environ) != 0,
        refused(fork()),
        refused(socket(AF_INET, SOCK_STREAM, 0)),
        refused(socket(AF_UNIX, SOCK_STREAM, 0)),
        refused(open("new", O_WRONLY | O_CREAT, 0666)),
        refused(open("there", O_RDWR)),
        refused(open("there", O_RDONLY | O_TRUNC)),
        refused(creat("new", 0666)),
        refused(unlink("there")),
        refused(rename("there", "elsewhere")),
        refused(link("there", "elsewhere")),
        refused(symlink("there", "elsewhere")),
        refused(mkdir("new", 0777)),
        refused(chmod("there", 0)),
        refused(truncate("there", 0)),
        refused(syscall(452, AT_FDCWD, "there", 0, 0)),                 /* fchmodat2 */
        refused(syscall(463, AT_FDCWD, "there", 0, "user.a", NULL, 0)), /* setxattrat */
        refused(syscall(466, AT_FDCWD, "there", 0, "user.a")),          /* removexattrat */
        refused(syscall(469, AT_FDCWD, "there", NULL, 0, 0)),           /* file_setattr */
        refused(ioctl(there, FS_IOC_SETFLAGS, flags)),
        refused(ioctl(there, FS_IOC_FSSETXATTR, flags)),
        refused(kill(getppid(), 0)),
        refused(unshare(CLONE_NEWUSER)),
    };
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
        if (!all[i])
            return (int)i + 1;
    return 0;
}

static void programs_processes_network_and_changes_to_files_are_denied(void **state)
{
    (void)state;
    int status = run_inside(try_denied_calls);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
    assert_int_equal(access("there", F_OK), 0);
}

static void *answer(void *user)
{
    return user;
}

static int descriptor; /* opened for writing before the sandbox starts */

static int try_allowed_calls(void)
{
    char text[8] = "";
    pthread_t thread;
    void *result = NULL;
    int fd = open("there", O_RDONLY);
    if (fd < 0 || read(fd, text, 4) != 4 || strcmp(text, "text") != 0)
        return 1;
    if (pthread_create(&thread, NULL, answer, text) != 0 || pthread_join(thread, &result) != 0 ||
        result != text)
        return 2;
    if (pwrite(descriptor, "more", 4, 0) != 4)
        return 3;
    return kill(getpid(), 0) == 0 ? 0 : 4;
}

static void reading_threads_and_open_descriptors_are_allowed(void **state)
{
    (void)state;
    descriptor = open(".", O_TMPFILE | O_RDWR, 0600);
    if (descriptor < 0)
        descriptor = open("/dev/null", O_WRONLY);
    int status = run_inside(try_allowed_calls);
    close(descriptor);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

static int end_by_abort(void)
{
    signal(SIGABRT, SIG_DFL);
    abort();
}

static void a_crash_still_reports_its_signal(void **state)
{
    (void)state;
    int status = run_inside(end_by_abort);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT);
}

/* Returns 0 if 80 MiB can be allocated and 1 GiB cannot, even after a request for a higher limit.
 */
static int try_memory(void)
{
    const size_t little = (size_t)80 << 20, much = (size_t)1 << 30;
    const int flags = MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE;
    trip_sandbox_limit_memory((uint64_t)32 << 20);
    void *some = mmap(NULL, little, PROT_READ | PROT_WRITE, flags, -1, 0);
    if (some == MAP_FAILED)
        return 1;
    trip_sandbox_limit_memory((uint64_t)2 << 30); /* a limit cannot be raised again */
    return mmap(NULL, much, PROT_READ | PROT_WRITE, flags, -1, 0) == MAP_FAILED ? 0 : 2;
}

static void memory_beyond_the_limit_is_refused(void **state)
{
    (void)state;
#if TEST_ADDRESS_SANITIZER
    print_message("skipped: AddressSanitizer keeps released memory, so that there is no limit\n");
    skip();
#endif
    int status = run_inside(try_memory);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(programs_processes_network_and_changes_to_files_are_denied),
        cmocka_unit_test(reading_threads_and_open_descriptors_are_allowed),
        cmocka_unit_test(a_crash_still_reports_its_signal),
        cmocka_unit_test(memory_beyond_the_limit_is_refused),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
