#include "scope.h"

#include <signal.h>
#include <stddef.h>

/* The program's: only the handler sets it, and only a program installs that. */
static volatile sig_atomic_t interrupted;

static _Thread_local trip_scope own;
static _Thread_local trip_scope *current; /* NULL: own */

trip_scope *trip_scope_current(void)
{
    return current ? current : &own;
}

trip_scope *trip_scope_enter(trip_scope *s)
{
    trip_scope *before = trip_scope_current();
    current = s;
    return before;
}

/* Relaxed: no other memory is published by it. */
void trip_scope_cancel(trip_scope *s)
{
    __atomic_store_n(&s->cancelled, true, __ATOMIC_RELAXED);
}

void trip_scope_renew(trip_scope *s)
{
    __atomic_store_n(&s->cancelled, false, __ATOMIC_RELAXED);
    __atomic_store_n(&s->reported, false, __ATOMIC_RELAXED);
}

int trip_interrupted(void)
{
    for (const trip_scope *s = trip_scope_current(); s; s = s->around)
        if (__atomic_load_n(&s->cancelled, __ATOMIC_RELAXED))
            return 1;
    return interrupted;
}

/* The scope that was cancelled, or the outermost. */
static trip_scope *ended_scope(void)
{
    trip_scope *s = trip_scope_current();
    while (s->around && !__atomic_load_n(&s->cancelled, __ATOMIC_RELAXED))
        s = s->around;
    return s;
}

bool trip_scope_report_once(void)
{
    return !trip_interrupted() ||
           !__atomic_exchange_n(&ended_scope()->reported, true, __ATOMIC_RELAXED);
}

static void on_signal(int number)
{
    (void)number;
    interrupted = 1;
    signal(SIGINT, SIG_DFL);
    signal(SIGTERM, SIG_DFL);
}

void trip_interrupt_install(void)
{
    struct sigaction action = { .sa_handler = on_signal, .sa_flags = SA_RESTART };
    sigemptyset(&action.sa_mask);
    interrupted = 0;
    trip_scope_renew(ended_scope());
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    signal(SIGXFSZ, SIG_IGN);
}
