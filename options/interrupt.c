#include "interrupt.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include "scope.h"

static volatile sig_atomic_t interrupted;

static bool is_ignored(int number)
{
    struct sigaction now;
    return sigaction(number, NULL, &now) == 0 && now.sa_handler == SIG_IGN;
}

/* SIGHUP and SIGQUIT stay ignored if they are ignored already, as under nohup. */
static const int ends[] = { SIGINT, SIGTERM, SIGHUP, SIGQUIT };
enum { ENDS = sizeof ends / sizeof *ends };

static bool stays_ignored(int number)
{
    return (number == SIGHUP || number == SIGQUIT) && is_ignored(number);
}

static void on_signal(int number)
{
    (void)number;
    interrupted = 1;
    for (int i = 0; i < ENDS; i++)
        if (!stays_ignored(ends[i]))
            signal(ends[i], SIG_DFL);
}

bool trip_interrupt_is_unread(int fd)
{
    struct pollfd p = { .fd = fd };
    return poll(&p, 1, 0) > 0 && p.revents & (POLLERR | POLLHUP);
}

/* A write met a pipe that nobody reads. It may have been another pipe than standard output. */
static void on_pipe(int number)
{
    const int saved_errno = errno;
    (void)number;
    if (trip_interrupt_is_unread(STDOUT_FILENO))
        interrupted = 1;
    errno = saved_errno;
}

void trip_interrupt_install(void)
{
    struct sigaction action = { .sa_handler = on_signal, .sa_flags = SA_RESTART };
    sigemptyset(&action.sa_mask);
    interrupted = 0;
    trip_scope_heed(&interrupted);
    for (int i = 0; i < ENDS; i++)
        if (!stays_ignored(ends[i]))
            sigaction(ends[i], &action, NULL);
    signal(SIGXFSZ, SIG_IGN);
    signal(SIGPIPE, SIG_IGN);
}

void trip_interrupt_at_end_of_output(void)
{
    struct sigaction action = { .sa_handler = on_pipe, .sa_flags = SA_RESTART };
    sigemptyset(&action.sa_mask);
    sigaction(SIGPIPE, &action, NULL);
}

void trip_interrupt_die_of_pipe(void)
{
    signal(SIGPIPE, SIG_DFL);
    raise(SIGPIPE);
}
