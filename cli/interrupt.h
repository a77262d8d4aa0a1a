/* For programs: signals end the work of their threads. The one flag of the process lies here, and
 * not in the libraries, whose scopes only point to it (common/scope.h). */
#ifndef TRIP_CLI_INTERRUPT_H
#define TRIP_CLI_INTERRUPT_H

/* Installs handlers for SIGINT, SIGTERM and, unless it is ignored as by nohup, SIGHUP (a terminal
 * that is gone), which interrupt what works in the calling thread's
 * scope and in those that are made there from then on. A second signal ends the process at once.
 * Writing beyond a limit on file sizes becomes an error (EFBIG) instead of the end of the process.
 * Called again, it forgets a signal. */
void trip_interrupt_install(void);

#endif
