/* Reports errors, warnings and notes to the user. Functions return 0 or a negative trip_status. The
 * function that detects a fault reports it once with trip_fail(); callers only forward the code.
 * Any thread may call these functions. Each message is one line, "triptych: stage: where: why". It
 * goes to the sink of the thread's scope, or to stderr. */
#ifndef TRIP_REPORT_H
#define TRIP_REPORT_H

#include <stddef.h>

#include "scope.h"

#ifdef __cplusplus
extern "C" {
#endif

enum trip_status {
    TRIP_OK = 0,
    TRIP_ERROR = -1,       /* failure; exit status 1 */
    TRIP_USAGE = -2,       /* wrong usage; exit status 2 */
    TRIP_INTERRUPTED = -3, /* Ctrl-C, SIGTERM or cancelled; exit status 1 */
};

/* Prints "triptych: STAGE: WHERE: why" and returns `status`. STAGE is "read", "brick", "render",
 * ... WHERE is the file and position ("a.nrrd: line 3"). `why` gives the cause and a remedy.
 * Control characters and invalid UTF-8 from files are made visible, so a message is always one
 * line. */
__attribute__((format(printf, 4, 5))) int trip_fail(int status, const char *stage,
                                                    const char *where, const char *why, ...);

/* Like trip_fail(), with strerror(errno) as the reason, after an optional action ("cannot open").
 */
int trip_fail_errno(const char *stage, const char *where, const char *action);

/* For static analysers, which do not see report.c: these functions never return 0. */
#ifdef __clang_analyzer__
#define trip_fail(status, ...) (trip_fail(status, __VA_ARGS__), (status))
#define trip_fail_errno(...) (trip_fail_errno(__VA_ARGS__), TRIP_ERROR)
#endif

/* Prints "triptych: warning: WHERE: why". */
__attribute__((format(printf, 2, 3))) void trip_warn(const char *where, const char *why, ...);

/* Prints "triptych: note: WHERE: ...", for a choice made for the user, and how to change it. */
__attribute__((format(printf, 2, 3))) void trip_note(const char *where, const char *stage, ...);

/* A sink that discards lines; see trip_scope.sink. */
void trip_report_discard(const char *line, void *user);

/* Reports a line that another scope received. */
void trip_report_line(const char *line);

/* Holds back the failures of a thread and keeps the first. If several threads share one task, only
 * the first failure is then reported. */
typedef struct trip_held_report {
    char line[4096];
    int status;
    struct trip_held_report *before; /* held report that was in use before */
} trip_held_report;

/* Keeps this thread's failures in `h` until trip_report_release() on the same thread. */
void trip_report_hold(trip_held_report *h);
void trip_report_release(trip_held_report *h);
/* Reports the kept failure, if any, as a failure of this thread. */
void trip_report_print(const trip_held_report *h);

/* Redirects the messages and failures of the calling thread's scope. NULL ends the redirection. No
 * other thread may be in the scope. */
void trip_report_redirect(void (*sink)(const char *line, void *user), void *user);

/* Calls trip_fail(TRIP_ERROR, stage, "NAME: line N", why, ...). */
__attribute__((format(printf, 4, 5))) int trip_fail_line(const char *stage, const char *name,
                                                         long line, const char *why, ...);

/* Returns the text, without a dot or a line feed. It lies in `room` or in static storage. */
const char *trip_errno_text(int error, char *room, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif
