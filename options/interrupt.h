/* Signal handlers for programs. The process has one flag, which is defined here. The libraries only
 * point to it from their scopes (common/scope.h). */
#ifndef TRIP_CLI_INTERRUPT_H
#define TRIP_CLI_INTERRUPT_H

#include <stdbool.h>

/* Installs handlers for SIGINT, SIGTERM, SIGHUP and SIGQUIT. SIGHUP and SIGQUIT stay ignored if
 * they are ignored already, as under nohup. A signal interrupts the work in the calling thread's
 * scope and in scopes created there later. A second signal ends the process at once. A write beyond
 * the limit on file sizes fails with EFBIG, and a write into a pipe that nobody reads fails with
 * EPIPE. Neither ends the process. A second call clears the flag. */
void trip_interrupt_install(void);

/* For a program with its results on standard output. Once nobody reads them, the next write to a
 * pipe interrupts the work like a signal. */
void trip_interrupt_at_end_of_output(void);
/* Returns whether nobody reads the pipe or socket behind a descriptor. */
bool trip_interrupt_is_unread(int fd);
/* Ends the process with SIGPIPE, as programs end that do not handle it. */
void trip_interrupt_die_of_pipe(void);

#endif
