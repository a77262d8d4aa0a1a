/* What a thread works for: where its messages go, and whether the work is still wanted. A thread
 * starts in a scope of its own, whose messages go to stderr and whose work ends with a signal to
 * the program; threads that work for another enter its scope. Nothing here belongs to the process
 * but the flag that trip_interrupt_install()'s handler sets. */
#ifndef TRIP_SCOPE_H
#define TRIP_SCOPE_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Starts zeroed. Several threads may be in one at a time; it outlives their stay. */
typedef struct trip_scope {
    struct trip_scope
        *around; /* takes the messages that this one does not, and ends its work too */
    /* Takes a failure, instead of the function below. */
    void (*failed)(void *user, int status, const char *line);
    /* Takes a line: a warning, a note, or a failure. NULL: the scope around it, or stderr. Both may
     * be called by any thread in the scope, and report in the scope around it. */
    void (*sink)(const char *line, void *user);
    void *user;
    /* Atomic; trip_scope_cancel() sets the one, the report of an interruption the other. */
    bool cancelled, reported;
} trip_scope;

/* The calling thread is in `s` from here on; returns the scope it leaves, to enter again. */
trip_scope *trip_scope_enter(trip_scope *s);
trip_scope *trip_scope_current(void);

/* Ends the work in a scope: trip_interrupted() is true for the threads in it, and in those that it
 * is around. Any thread. */
void trip_scope_cancel(trip_scope *s);
/* Makes a cancelled scope good again, when no thread works in it. */
void trip_scope_renew(trip_scope *s);

/* Whether the calling thread's work is no longer wanted: long loops look and return
 * trip_fail(TRIP_INTERRUPTED, ...), of which each scope reports one. */
int trip_interrupted(void);

/* For programs: installs handlers for SIGINT and SIGTERM, which interrupt all threads. A second
 * signal ends the process at once. Writing beyond a limit on file sizes becomes an error (EFBIG)
 * instead of the end of the process. */
void trip_interrupt_install(void);

/* Whether an interruption of this thread's work is to be reported: once for a scope that was
 * cancelled, once for a signal. */
bool trip_scope_report_once(void);

#ifdef __cplusplus
}
#endif

#endif
