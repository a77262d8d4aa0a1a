#include "image_helper.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <spawn.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "report.h"

#define PROGRAM "triptych-images"
enum { TEXT_BYTES = 4096 };

struct trip_image_helper {
    const char *what;
    char path[PATH_MAX]; /* of the last request */
    pid_t pid;
    int fd;
    bool broken;
};

/* Beside this program, where it is installed, or where it was built. */
static bool find_program(char path[PATH_MAX])
{
    static const char *const places[] = { "", "../libexec/triptych/" };
    char self[PATH_MAX];
    ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    self[n > 0 ? n : 0] = 0;
    char *slash = strrchr(self, '/');
    for (size_t i = 0; slash && i < sizeof places / sizeof places[0]; i++) {
        slash[1] = 0;
        int length = snprintf(path, PATH_MAX, "%s%s" PROGRAM, self, places[i]);
        if (length < PATH_MAX && access(path, X_OK) == 0)
            return true;
    }
    snprintf(path, PATH_MAX, "%s", TRIP_IMAGE_HELPER_BUILT);
    return access(path, X_OK) == 0;
}

/* The connection as descriptor 3, nothing to read or to print to, signals as they come. */
static int spawn(const char *program, int fd, pid_t *pid)
{
    char *argv[] = { (char[]){ PROGRAM }, NULL };
    sigset_t none;
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    sigemptyset(&none);
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
    posix_spawn_file_actions_adddup2(&files, fd, TRIP_IMAGE_HELPER_FD);
    for (int i = 0; i < TRIP_IMAGE_HELPER_FD; i++)
        posix_spawn_file_actions_addopen(&files, i, "/dev/null", O_RDWR, 0);
    posix_spawn_file_actions_addclosefrom_np(&files, TRIP_IMAGE_HELPER_FD + 1);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
    int error = posix_spawn(pid, program, &files, &attributes, argv, environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    return error;
}

int trip_image_helper_start(trip_image_helper **out, const char *what)
{
    char program[PATH_MAX];
    int fds[2];
    if (!find_program(program))
        return trip_fail(TRIP_ERROR, what, PROGRAM,
                         "is not beside this program nor in ../libexec/triptych; it reads and "
                         "writes pictures");
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, fds) != 0)
        return trip_fail_errno(what, program, "cannot connect");
    trip_image_helper *h = calloc(1, sizeof *h);
    int error = h ? spawn(program, fds[1], &h->pid) : ENOMEM;
    close(fds[1]);
    if (h && error == 0) {
        h->what = what;
        h->fd = fds[0];
        *out = h;
        return 0;
    }
    close(fds[0]);
    free(h);
    errno = error;
    return trip_fail_errno(what, program, "cannot start");
}

void trip_image_helper_stop(trip_image_helper *h)
{
    if (!h)
        return;
    close(h->fd);
    if (h->pid > 0) {
        kill(h->pid, SIGKILL);
        waitpid(h->pid, NULL, 0);
    }
    free(h);
}

/* The connection is gone: the helper is, too. */
static int helper_lost(trip_image_helper *h)
{
    int status = 0;
    h->broken = true;
    if (h->pid > 0) {
        kill(h->pid, SIGKILL);
        waitpid(h->pid, &status, 0);
    }
    h->pid = 0;
    if (WIFSIGNALED(status) && WTERMSIG(status) != SIGKILL)
        return trip_fail(TRIP_ERROR, h->what, h->path,
                         "brought the decoder down (%s): corrupt, or of an unusual kind",
                         strsignal(WTERMSIG(status)));
    return trip_fail(TRIP_ERROR, h->what, h->path, PROGRAM " ended before it was done");
}

int trip_image_helper_request(trip_image_helper *h, enum trip_image_task task, const char *path,
                              const int64_t numbers[5])
{
    trip_image_request request = { .task = task, .path_bytes = (uint32_t)strlen(path) };
    if (numbers)
        memcpy(request.numbers, numbers, sizeof request.numbers);
    if (request.path_bytes >= PATH_MAX)
        return trip_fail(TRIP_ERROR, h->what, path, "has a name that is too long");
    memcpy(h->path, path, request.path_bytes + 1);
    if (h->broken)
        return helper_lost(h);
    if (!trip_image_send_all(h->fd, &request, sizeof request) ||
        !trip_image_send_all(h->fd, path, request.path_bytes))
        return helper_lost(h);
    return 0;
}

int trip_image_helper_send(trip_image_helper *h, const void *data, size_t bytes)
{
    return trip_image_send_all(h->fd, data, bytes) ? 0 : helper_lost(h);
}

int trip_image_helper_receive(trip_image_helper *h, void *data, size_t bytes)
{
    return trip_image_receive_all(h->fd, data, bytes) ? 0 : helper_lost(h);
}

int trip_image_helper_outcome(trip_image_helper *h, uint64_t *data_bytes_out)
{
    for (;;) {
        trip_image_reply reply;
        char where[TEXT_BYTES], why[TEXT_BYTES];
        if (!trip_image_receive_all(h->fd, &reply, sizeof reply) ||
            reply.where_bytes >= sizeof where || reply.why_bytes >= sizeof why ||
            !trip_image_receive_all(h->fd, where, reply.where_bytes) ||
            !trip_image_receive_all(h->fd, why, reply.why_bytes))
            return helper_lost(h);
        where[reply.where_bytes] = why[reply.why_bytes] = 0;
        if (reply.outcome == TRIP_IMAGE_DONE) {
            *data_bytes_out = reply.data_bytes;
            return 0;
        }
        if (reply.outcome == TRIP_IMAGE_FAILED)
            return trip_fail(reply.status < 0 ? reply.status : TRIP_ERROR, h->what, where, "%s",
                             why);
        trip_warn(where, "%s", why);
    }
}
