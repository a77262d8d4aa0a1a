/* Signal handlers for programs. The process has one flag, which is defined here. The libraries only
 * point to it from their scopes (common/scope.h). */
#ifndef TRIP_CLI_INTERRUPT_H
#define TRIP_CLI_INTERRUPT_H

/* Installs handlers for SIGINT, SIGTERM and SIGHUP. SIGHUP stays ignored if it is ignored already,
 * as under nohup. A signal interrupts the work in the calling thread's scope and in scopes created
 * there later. A second signal ends the process at once. A write beyond the limit on file sizes
 * fails with EFBIG instead of ending the process. A second call clears the flag. */
void trip_interrupt_install(void);

#endif
