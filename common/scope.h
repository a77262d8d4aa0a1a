/* The scope of a thread's work: where its messages go, and whether the work is cancelled. A thread
 * begins in a scope of its own, whose messages go to stderr; threads that work for another thread
 * enter its scope. Nothing is kept for the whole process: that a signal came is in a flag of
 * the program's, if scopes point to one. */
#ifndef TRIP_SCOPE_H
#define TRIP_SCOPE_H

#include <signal.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Initially zeroed. Several threads may be in a scope; it exists until all have left it. */
typedef struct trip_scope {
    struct trip_scope
        *around; /* gets the messages that this one does not take; cancelling it cancels this one */
    /* Takes failures, if not NULL, in place of sink(). */
    void (*failed)(void *user, int status, const char *line);
    /* Takes a line: a warning, a note, or a failure. NULL: lines go to the scope around this one,
     * or to stderr. Both functions may be called by any thread in the scope; what they report goes
     * to the scope around it. */
    void (*sink)(const char *line, void *user);
    void *user;
    /* Atomic. Cancelled by trip_scope_cancel(); its interruption was reported. */
    bool cancelled, reported;
    /* Not 0: cancelled, too. Of a program, which sets it for as long as it runs; or NULL. */
    const volatile sig_atomic_t *signalled;
} trip_scope;

/* Moves the calling thread to scope `s`; returns the scope it leaves, to be entered again. */
trip_scope *trip_scope_enter(trip_scope *s);
trip_scope *trip_scope_current(void);

/* Cancels the work in a scope: trip_interrupted() becomes true for the threads in it and in the
 * scopes that it is around. Any thread. */
void trip_scope_cancel(trip_scope *s);
/* Ends the cancelling, so that the scope can be used again; no thread may be working in it. */
void trip_scope_renew(trip_scope *s);

/* An interruption of its work that was reported is to be reported once more. */
void trip_scope_report_anew(trip_scope *s);

/* The outermost scope around the calling thread's has this flag, which is not set yet. */
void trip_scope_heed(const volatile sig_atomic_t *signalled);
/* The flag of the calling thread's scope or of one around it, for scopes that have none around them
 * and for threads that begin in their own; or NULL. */
const volatile sig_atomic_t *trip_scope_signal(void);

/* Whether the calling thread's work is cancelled, or a signal came: long loops check this
 * and return trip_fail(TRIP_INTERRUPTED, ...), of which each scope reports one. */
int trip_interrupted(void);

/* Whether this thread is to report the interruption of its work: true once for each cancelled scope
 * and once for a signal. */
bool trip_scope_report_once(void);

#ifdef __cplusplus
}
#endif

#endif
