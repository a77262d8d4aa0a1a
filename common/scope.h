/* The scope of a thread's work: the destination of its messages, and whether the work is cancelled.
 * A thread starts in a scope of its own, with messages to stderr. Threads that work for another
 * thread enter its scope. The process has no global state; a program that handles signals owns a
 * flag, and scopes may point to it. */
#ifndef TRIP_SCOPE_H
#define TRIP_SCOPE_H

#include <signal.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Zero it before use. Several threads may be in a scope. It must exist until all have left it. */
typedef struct trip_scope {
    /* The enclosing scope. It receives the messages that this scope does not handle. Cancelling it
     * cancels this scope too. */
    struct trip_scope *around;
    /* If not NULL, receives failures instead of sink(). */
    void (*failed)(void *user, int status, const char *line);
    /* Receives a line: a warning, a note or a failure. If NULL, lines go to the enclosing scope, or
     * to stderr. Any thread in the scope may call both functions. Their own reports go to the
     * enclosing scope. */
    void (*sink)(const char *line, void *user);
    void *user;
    /* Atomic. `cancelled` is set by trip_scope_cancel(), `reported` after the interruption was
     * reported. */
    bool cancelled, reported;
    /* A value other than 0 also means cancelled. The flag belongs to the program. May be NULL. */
    const volatile sig_atomic_t *signalled;
} trip_scope;

/* Moves the calling thread to scope `s`. Returns the scope that it leaves, to enter again later. */
trip_scope *trip_scope_enter(trip_scope *s);
trip_scope *trip_scope_current(void);

/* Cancels the work in a scope. trip_interrupted() becomes true for its threads and for the threads
 * of the scopes inside it. Any thread. */
void trip_scope_cancel(trip_scope *s);
/* Clears the cancellation, so that the scope can be used again. No thread may be working in it. */
void trip_scope_renew(trip_scope *s);

/* Allows one more report of an interruption. */
void trip_scope_report_anew(trip_scope *s);

/* Sets the flag of the outermost scope around the calling thread's scope. The flag must not be set
 * yet. */
void trip_scope_heed(const volatile sig_atomic_t *signalled);
/* Returns the flag of the calling thread's scope or of an enclosing scope, or NULL. Other outermost
 * scopes and threads can then use the same flag. */
const volatile sig_atomic_t *trip_scope_signal(void);

/* Whether the calling thread's work is cancelled, or a signal came. Long loops check this and
 * return trip_fail(TRIP_INTERRUPTED, ...). Each scope reports only one such failure. */
int trip_interrupted(void);

/* Whether this thread reports the interruption of its work. Returns true once per cancelled scope
 * and once per signal. */
bool trip_scope_report_once(void);
/* Lets trip_scope_report_once() return true once more, because the first report reached nobody. */
void trip_scope_report_again(void);

#ifdef __cplusplus
}
#endif

#endif
