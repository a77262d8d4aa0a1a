#include "progress_line.h"

#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

enum { INTERVAL_MS = 250, LINES_INTERVAL_MS = 2000 };

struct measure_progress {
    const char *name;
    bool lines; /* prints line below line, because stderr is not a terminal */
    struct timespec begin;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t stop;
    /* Guarded by lock. */
    bool stopped;
    int begun, expected; /* numbers of steps */
    char stage[48];
};

static unsigned seconds_since(const struct timespec *begin)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (unsigned)(now.tv_sec - begin->tv_sec - (now.tv_nsec < begin->tv_nsec));
}

/* Prints the line. The next output overwrites it. */
static void print_line(const measure_progress *p)
{
    unsigned s = seconds_since(&p->begin);
    fprintf(stderr, "%s%s  %u:%02u", p->lines ? "" : "\r\033[K", p->name, s / 60, s % 60);
    if (p->begun)
        fprintf(stderr, "  step %d of %d: %s", p->begun, p->expected, p->stage);
    fputc(p->lines ? '\n' : '\r', stderr);
    fflush(stderr);
}

static struct timespec time_of_next_line(int interval_ms)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    t.tv_nsec += interval_ms % 1000 * 1000000L;
    t.tv_sec += interval_ms / 1000 + t.tv_nsec / 1000000000L;
    t.tv_nsec %= 1000000000L;
    return t;
}

static void *show(void *argument)
{
    measure_progress *p = argument;
    pthread_mutex_lock(&p->lock);
    do {
        struct timespec next = time_of_next_line(p->lines ? LINES_INTERVAL_MS : INTERVAL_MS);
        print_line(p);
        while (!p->stopped && pthread_cond_timedwait(&p->stop, &p->lock, &next) == 0)
            ;
    } while (!p->stopped);
    pthread_mutex_unlock(&p->lock);
    return NULL;
}

/* Starts the thread with all signals blocked, so that the main thread gets them. */
static bool start_thread(measure_progress *p)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    bool started = pthread_create(&p->thread, NULL, show, p) == 0;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return started;
}

static void release(measure_progress *p)
{
    pthread_cond_destroy(&p->stop);
    pthread_mutex_destroy(&p->lock);
    free(p);
}

static measure_progress *start(const char *name, bool lines)
{
    measure_progress *p = calloc(1, sizeof *p);
    if (!p)
        return NULL;
    p->lines = lines;
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&p->stop, &attributes);
    pthread_condattr_destroy(&attributes);
    pthread_mutex_init(&p->lock, NULL);
    p->name = name;
    clock_gettime(CLOCK_MONOTONIC, &p->begin);
    if (start_thread(p))
        return p;
    release(p);
    return NULL;
}

measure_progress *measure_progress_start(const char *name)
{
    return isatty(STDERR_FILENO) == 1 ? start(name, false) : NULL;
}

measure_progress *measure_progress_start_lines(const char *name)
{
    return start(name, isatty(STDERR_FILENO) != 1);
}

void measure_progress_expect(measure_progress *p, int steps)
{
    if (!p)
        return;
    pthread_mutex_lock(&p->lock);
    p->expected += steps;
    pthread_mutex_unlock(&p->lock);
}

void measure_progress_step(measure_progress *p, const char *stage)
{
    if (!p)
        return;
    pthread_mutex_lock(&p->lock);
    p->begun++;
    snprintf(p->stage, sizeof p->stage, "%s", stage);
    pthread_mutex_unlock(&p->lock);
}

void measure_progress_part(measure_progress *p, const char *stage)
{
    if (!p)
        return;
    pthread_mutex_lock(&p->lock);
    snprintf(p->stage, sizeof p->stage, "%s", stage);
    pthread_mutex_unlock(&p->lock);
}

void measure_progress_end(measure_progress *p)
{
    if (!p)
        return;
    pthread_mutex_lock(&p->lock);
    p->stopped = true;
    pthread_cond_signal(&p->stop);
    pthread_mutex_unlock(&p->lock);
    pthread_join(p->thread, NULL);
    if (p->begun == p->expected)
        print_line(p);
    if (!p->lines)
        fputs("\r\033[K", stderr);
    release(p);
}
