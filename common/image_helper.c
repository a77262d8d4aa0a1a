#include "image_helper.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "companion.h"
#include "report.h"

enum {
    TEXT_BYTES = 4096,
    MAX_WARNINGS = 64,    /* in one request */
    MAX_SIGNS = 1 << 20,  /* of TRIP_IMAGE_WORKING in one request; they come a second apart */
    PATIENCE_MS = 120000, /* maximum time without a byte from the helper */
    WAIT_MS = 100,        /* between checks of the interrupt flag */
    REAP_MS = 1000,
};

typedef struct helper_program {
    const char *name;
    const char *built; /* path in the build folder; NULL if it was not built */
    const char *does;
} helper_program;

static const helper_program image_program = { "triptych-images", TRIP_IMAGE_HELPER_BUILT,
                                              "reads and writes pictures" };
static const helper_program netcdf_program = { "triptych-netcdf", TRIP_NETCDF_HELPER_BUILT,
                                               "reads netCDF-4" };

struct trip_image_helper {
    const char *stage;
    const char *program;
    char path[PATH_MAX]; /* of the last request */
    pid_t pid;           /* 0 once it has ended */
    int fd;
    int patience_ms;
    bool broken;
};

/* Replaces the helper program in tests. */
static _Thread_local trip_image_stand_in stand_in;
static _Thread_local int stand_in_patience_ms;

void trip_image_helper_replace(trip_image_stand_in peer, int patience_ms)
{
    stand_in = peer;
    stand_in_patience_ms = patience_ms;
}

/* Data for the new process, and its result. */
typedef struct launch {
    char *program;
    int fd;
    pid_t parent;
    volatile int error; /* errno if the program did not start */
} launch;

/* Resets signal handlers and SIGPIPE in the new process. Until execve() this process shares the
 * memory of its parent, so no handler may run in it. For this reason all signals are blocked
 * before. */
static void reset_signals(void)
{
    struct sigaction handler;
    sigset_t none;
    for (int s = 1; s < NSIG; s++)
        if (sigaction(s, NULL, &handler) == 0 && handler.sa_handler != SIG_DFL &&
            (handler.sa_handler != SIG_IGN || s == SIGPIPE))
            signal(s, SIG_DFL);
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
}

/* Runs in the new process. Makes the connection descriptor 3, opens /dev/null as descriptors 0 to 2
 * and unblocks signals. From its first instruction on, the kernel ends the program with the thread
 * that started it. If the parent ended before prctl(), the parent id has changed. */
static _Noreturn void become_helper(launch *l)
{
    char *argv[] = { l->program, NULL };
    bool ready = prctl(PR_SET_PDEATHSIG, SIGKILL) == 0 && getppid() == l->parent &&
                 (l->fd == TRIP_IMAGE_HELPER_FD ? fcntl(l->fd, F_SETFD, 0)
                                                : dup2(l->fd, TRIP_IMAGE_HELPER_FD)) >= 0;
    for (int i = 0; i < TRIP_IMAGE_HELPER_FD && ready; i++) {
        int null = open("/dev/null", O_RDWR | O_CLOEXEC);
        ready = null >= 0 && (null == i ? fcntl(i, F_SETFD, 0) : dup2(null, i)) >= 0;
    }
    if (ready) {
        closefrom(TRIP_IMAGE_HELPER_FD + 1);
        reset_signals();
        execve(l->program, argv, environ);
    }
    l->error = errno ? errno : ECHILD;
    _exit(127);
}

/* Returns 0, or the errno of the failure. */
static int spawn(char *program, int fd, pid_t *pid)
{
    launch l = { .program = program, .fd = fd, .parent = getpid() };
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    *pid = vfork();
    if (*pid == 0)
        become_helper(&l);
    int error = *pid < 0 ? errno : l.error;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (*pid > 0 && error)
        waitpid(*pid, NULL, 0);
    if (error)
        *pid = 0;
    return error;
}

static int start(trip_image_helper **out, const char *stage, const helper_program *of)
{
    char program[PATH_MAX] = "";
    int fds[2], error = ENOMEM;
    if (!stand_in && !of->built)
        return trip_fail(TRIP_ERROR, stage, of->name, "was not built; this program %s", of->does);
    if (!stand_in && !trip_companion_find(program, of->name, of->built, X_OK))
        return trip_fail(TRIP_ERROR, stage, of->name,
                         "is neither beside triptych nor in ../libexec/triptych; this program %s",
                         of->does);
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, fds) != 0)
        return trip_fail_errno(stage, program, "cannot create a connection");
    trip_image_helper *h = calloc(1, sizeof *h);
    if (h)
        error = stand_in ? stand_in(fds[1]) : spawn(program, fds[1], &h->pid);
    close(fds[1]);
    if (h && error == 0) {
        h->stage = stage;
        h->program = of->name;
        h->fd = fds[0];
        h->patience_ms = stand_in ? stand_in_patience_ms : PATIENCE_MS;
        *out = h;
        return 0;
    }
    close(fds[0]);
    free(h);
    errno = error;
    return trip_fail_errno(stage, program, "cannot start");
}

int trip_image_helper_start(trip_image_helper **out, const char *stage)
{
    return start(out, stage, &image_program);
}

int trip_image_helper_start_netcdf(trip_image_helper **out, const char *stage)
{
    return start(out, stage, &netcdf_program);
}

/* Ends the process and returns its status. The kernel may not be able to end it at once, for
 * example during a read from a dead network disk. Then it remains, and the kernel ends it later. */
static int end_process(trip_image_helper *h)
{
    int status = 0;
    if (h->pid > 0)
        kill(h->pid, SIGKILL);
    for (int ms = 0; h->pid > 0 && ms < REAP_MS; ms++) {
        if (waitpid(h->pid, &status, WNOHANG) != 0)
            break;
        nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
    }
    h->pid = 0;
    return status;
}

void trip_image_helper_stop(trip_image_helper *h)
{
    if (!h)
        return;
    close(h->fd);
    end_process(h);
    free(h);
}

/* Reports that the helper has closed the connection. */
static int helper_lost(trip_image_helper *h)
{
    int status = end_process(h);
    h->broken = true;
    if (WIFSIGNALED(status) && WTERMSIG(status) != SIGKILL)
        return trip_fail(
            TRIP_ERROR, h->stage, h->path,
            "crashed the decoder (%s); the file may be corrupt or of an unsupported kind",
            strsignal(WTERMSIG(status)));
    return trip_fail(TRIP_ERROR, h->stage, h->path, "%s ended too early", h->program);
}

int trip_image_helper_distrust(trip_image_helper *h, const char *why)
{
    end_process(h);
    h->broken = true;
    return trip_fail(TRIP_ERROR, h->stage, h->path, "%s sent an invalid reply: %s", h->program,
                     why);
}

/* Waits until the connection can be read or written. Returns 0 or a reported failure; the helper is
 * then ended. */
static int wait_for(trip_image_helper *h, short events)
{
    for (int waited_ms = 0; waited_ms < h->patience_ms;) {
        struct pollfd p = { .fd = h->fd, .events = events };
        if (trip_interrupted()) {
            end_process(h);
            h->broken = true;
            return trip_fail(TRIP_INTERRUPTED, h->stage, h->path, "interrupted");
        }
        int ms = h->patience_ms < WAIT_MS ? h->patience_ms : WAIT_MS;
        int ready = poll(&p, 1, ms);
        if (ready > 0)
            return 0;
        if (ready == 0)
            waited_ms += ms;
    }
    end_process(h);
    h->broken = true;
    return trip_fail(
        TRIP_ERROR, h->stage, h->path,
        "%s has not answered for %g s; the file may be corrupt or of an unsupported kind",
        h->program, h->patience_ms / 1e3);
}

static bool has_to_wait(ssize_t n)
{
    return n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR);
}

int trip_image_helper_send(trip_image_helper *h, const void *data, size_t bytes)
{
    for (size_t done = 0; done < bytes;) {
        int status = wait_for(h, POLLOUT);
        if (status < 0)
            return status;
        ssize_t n =
            send(h->fd, (const char *)data + done, bytes - done, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (n < 0 && !has_to_wait(n))
            return helper_lost(h);
        done += n > 0 ? (size_t)n : 0;
    }
    return 0;
}

int trip_image_helper_receive(trip_image_helper *h, void *data, size_t bytes)
{
    for (size_t done = 0; done < bytes;) {
        int status = wait_for(h, POLLIN);
        if (status < 0)
            return status;
        ssize_t n = recv(h->fd, (char *)data + done, bytes - done, MSG_DONTWAIT);
        if (n == 0 || (n < 0 && !has_to_wait(n)))
            return helper_lost(h);
        done += n > 0 ? (size_t)n : 0;
    }
    return 0;
}

/* Sends one byte, and the descriptor with it unless it is -1. */
static int send_descriptor(trip_image_helper *h, int fd)
{
    union {
        struct cmsghdr header;
        char bytes[CMSG_SPACE(sizeof(int))];
    } control = { .bytes = { 0 } };
    struct iovec one = { .iov_base = (char[]){ 0 }, .iov_len = 1 };
    struct msghdr message = { .msg_iov = &one, .msg_iovlen = 1 };
    if (fd >= 0) {
        message.msg_control = &control;
        message.msg_controllen = sizeof control;
        struct cmsghdr *c = CMSG_FIRSTHDR(&message);
        *c = (struct cmsghdr){ .cmsg_len = CMSG_LEN(sizeof fd),
                               .cmsg_level = SOL_SOCKET,
                               .cmsg_type = SCM_RIGHTS };
        memcpy(CMSG_DATA(c), &fd, sizeof fd);
    }
    for (;;) {
        int status = wait_for(h, POLLOUT);
        if (status < 0)
            return status;
        ssize_t n = sendmsg(h->fd, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (n == 1)
            return 0;
        if (!has_to_wait(n))
            return helper_lost(h);
    }
}

int trip_image_helper_request(trip_image_helper *h, enum trip_image_task task, const char *path,
                              const int64_t numbers[5], int fd)
{
    trip_image_request request = { .task = task, .path_bytes = (uint32_t)strlen(path) };
    if (numbers)
        memcpy(request.numbers, numbers, sizeof request.numbers);
    if (request.path_bytes >= PATH_MAX)
        return trip_fail(TRIP_ERROR, h->stage, path, "has a path that is too long");
    memcpy(h->path, path, request.path_bytes + 1);
    if (h->broken)
        return helper_lost(h);
    int status = send_descriptor(h, fd);
    if (status == 0)
        status = trip_image_helper_send(h, &request, sizeof request);
    return status < 0 ? status : trip_image_helper_send(h, path, request.path_bytes);
}

/* Receives a reply with its texts, and checks that it is valid. */
static int receive_reply(trip_image_helper *h, trip_image_reply *reply, char where[TEXT_BYTES],
                         char why[TEXT_BYTES])
{
    int status = trip_image_helper_receive(h, reply, sizeof *reply);
    if (status < 0)
        return status;
    if (reply->where_bytes >= TEXT_BYTES || reply->why_bytes >= TEXT_BYTES)
        return trip_image_helper_distrust(h, "a text that is too long");
    status = trip_image_helper_receive(h, where, reply->where_bytes);
    if (status == 0)
        status = trip_image_helper_receive(h, why, reply->why_bytes);
    if (status < 0)
        return status;
    where[reply->where_bytes] = why[reply->why_bytes] = 0;
    bool done = reply->outcome == TRIP_IMAGE_DONE, failed = reply->outcome == TRIP_IMAGE_FAILED;
    if (!done && reply->data_bytes > 0)
        return trip_image_helper_distrust(h, "unexpected data");
    if (failed && reply->status != TRIP_ERROR && reply->status != TRIP_USAGE)
        return trip_image_helper_distrust(h, "an unknown status");
    return 0;
}

int trip_image_helper_outcome(trip_image_helper *h, uint64_t *data_bytes_out)
{
    int warnings = 0, signs = 0;
    for (;;) {
        trip_image_reply reply;
        char where[TEXT_BYTES], why[TEXT_BYTES];
        int status = receive_reply(h, &reply, where, why);
        if (status < 0)
            return status;
        switch (reply.outcome) {
        case TRIP_IMAGE_DONE:
            *data_bytes_out = reply.data_bytes;
            return 0;
        case TRIP_IMAGE_FAILED:
            return trip_fail(reply.status, h->stage, where, "%s", why);
        case TRIP_IMAGE_WARNING:
            if (++warnings > MAX_WARNINGS)
                return trip_image_helper_distrust(h, "too many warnings");
            trip_warn(where, "%s", why);
            break;
        case TRIP_IMAGE_WORKING:
            if (++signs > MAX_SIGNS)
                return trip_image_helper_distrust(h, "too many signs of life");
            break;
        default:
            return trip_image_helper_distrust(h, "an unknown outcome");
        }
    }
}

int trip_image_helper_expect(trip_image_helper *h, uint64_t data_bytes)
{
    uint64_t bytes;
    int status = trip_image_helper_outcome(h, &bytes);
    if (status == 0 && bytes != data_bytes)
        return trip_image_helper_distrust(h, "data of the wrong size");
    return status;
}
