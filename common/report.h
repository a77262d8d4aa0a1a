/* Reports of errors, warnings and choices to the user. Functions return 0 or a negative
 * trip_status: the function that detects a fault reports it once with trip_fail(), callers only
 * forward the code. Any thread may call these. Each message is one line, "triptych: what: where:
 * why", and goes to the sink of the thread's scope, or to stderr. */
#ifndef TRIP_REPORT_H
#define TRIP_REPORT_H

#include "scope.h"

#ifdef __cplusplus
extern "C" {
#endif

enum trip_status {
    TRIP_OK = 0,
    TRIP_ERROR = -1,       /* failed: exit status 1 */
    TRIP_USAGE = -2,       /* wrong usage: exit status 2 */
    TRIP_INTERRUPTED = -3, /* Ctrl-C, SIGTERM or cancelled: exit status 1 */
};

/* Prints "triptych: WHAT: WHERE: why" and returns `status`. WHAT is the stage ("read", "brick",
 * "render", ...), WHERE the file and place ("a.nrrd: line 3"), why says cause and remedy. Control
 * characters and bad UTF-8 from files are made visible, so a message is always one line. */
__attribute__((format(printf, 4, 5))) int trip_fail(int status, const char *stage,
                                                    const char *where, const char *why, ...);

/* Like trip_fail() with strerror(errno) as the why, after an optional action ("cannot open"). */
int trip_fail_errno(const char *stage, const char *where, const char *action);

/* For static analysers, which see callers without report.c: these results are never 0. */
#ifdef __clang_analyzer__
#define trip_fail(status, ...) (trip_fail(status, __VA_ARGS__), (status))
#define trip_fail_errno(...) (trip_fail_errno(__VA_ARGS__), TRIP_ERROR)
#endif

/* Prints "triptych: warning: WHERE: why". */
__attribute__((format(printf, 2, 3))) void trip_warn(const char *where, const char *why, ...);

/* Prints "triptych: note: WHERE: what": a choice made for the user, and how to make another. */
__attribute__((format(printf, 2, 3))) void trip_note(const char *where, const char *stage, ...);

/* Reports a line that another scope took. */
void trip_report_line(const char *line);

/* Holds back failures of a thread: the first is kept instead of reported, so that of several
 * threads that do one work only the first failure is reported. */
typedef struct trip_held_report {
    char line[4096];
    int status;
    struct trip_held_report *before; /* the one that was in use before */
} trip_held_report;

/* From here on `h` keeps this thread's failures, until release, on the same thread. */
void trip_report_hold(trip_held_report *h);
void trip_report_release(trip_held_report *h);
/* Reports what was kept, if anything, as a failure of this thread. */
void trip_report_print(const trip_held_report *h);

/* Redirects the lines of the calling thread's scope, its failures among them; NULL ends that. No
 * other thread may be in the scope. */
void trip_report_redirect(void (*sink)(const char *line, void *user), void *user);

#ifdef __cplusplus
}
#endif

#endif
