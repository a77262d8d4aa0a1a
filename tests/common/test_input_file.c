#include "input_file.h"
#include "interrupt.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test.h"

static char folder[] = "input_file-XXXXXX";

static int enter_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) && chdir(folder) == 0 ? mkfifo("pipe", 0666) : -1;
}

static int leave_folder(void **state)
{
    (void)state;
    return unlink("pipe") == 0 && chdir("..") == 0 ? rmdir(folder) : -1;
}

static void a_file_is_read_to_its_end(void **state)
{
    (void)state;
    char text[16] = "";
    FILE *f = fopen("file", "w");
    assert_true(f && fputs("some text", f) >= 0 && fclose(f) == 0);
    int fd = trip_input_open("file");
    assert_int_equal(trip_input_read(fd, text, 4), 4);
    assert_int_equal(trip_input_read(fd, text + 4, sizeof text - 5), 5);
    assert_string_equal(text, "some text");
    close(fd);
    unlink("file");
    assert_int_equal(trip_input_open("file"), -1);
    assert_int_equal(errno, ENOENT);
}

static void a_pipe_is_read_to_its_end(void **state)
{
    (void)state;
    char text[16] = "";
    int fd = trip_input_open("pipe"); /* no process writes yet */
    assert_true(fd >= 0);
    pid_t child = fork();
    if (child == 0) {
        int to = open("pipe", O_WRONLY);
        _exit(write(to, "in ", 3) == 3 && write(to, "parts", 5) == 5 ? 0 : 1);
    }
    assert_int_equal(trip_input_read(fd, text, sizeof text - 1), 8);
    assert_string_equal(text, "in parts");
    assert_int_equal(waitpid(child, NULL, 0), child);
    close(fd);
}

static void a_signal_ends_the_wait_for_a_pipe(void **state)
{
    (void)state;
    char text[16];
    int fd = trip_input_open("pipe");
    trip_interrupt_install();
    raise(SIGTERM);
    assert_int_equal(trip_input_read(fd, text, sizeof text), -1);
    assert_int_equal(errno, EINTR);
    trip_interrupt_install(); /* forgets the signal */
    close(fd);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_file_is_read_to_its_end),
        cmocka_unit_test(a_pipe_is_read_to_its_end),
        cmocka_unit_test(a_signal_ends_the_wait_for_a_pipe),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
