#include "scope.h"

#include <stddef.h>

static _Thread_local trip_scope own;
static _Thread_local trip_scope *current; /* NULL means `own` */

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

/* Relaxed, since the flag publishes no other memory. */
void trip_scope_cancel(trip_scope *s)
{
    __atomic_store_n(&s->cancelled, true, __ATOMIC_RELAXED);
}

void trip_scope_renew(trip_scope *s)
{
    __atomic_store_n(&s->cancelled, false, __ATOMIC_RELAXED);
    __atomic_store_n(&s->reported, false, __ATOMIC_RELAXED);
}

void trip_scope_report_anew(trip_scope *s)
{
    __atomic_store_n(&s->reported, false, __ATOMIC_RELAXED);
}

int trip_interrupted(void)
{
    for (const trip_scope *s = trip_scope_current(); s; s = s->around)
        if (__atomic_load_n(&s->cancelled, __ATOMIC_RELAXED) || (s->signalled && *s->signalled))
            return 1;
    return 0;
}

const volatile sig_atomic_t *trip_scope_signal(void)
{
    for (const trip_scope *s = trip_scope_current(); s; s = s->around)
        if (s->signalled)
            return s->signalled;
    return NULL;
}

/* Returns the cancelled scope, or the outermost scope. */
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

void trip_scope_report_again(void)
{
    trip_scope_report_anew(ended_scope());
}

void trip_scope_heed(const volatile sig_atomic_t *signalled)
{
    trip_scope *s = trip_scope_current();
    while (s->around)
        s = s->around;
    s->signalled = signalled;
    trip_scope_renew(s);
}
