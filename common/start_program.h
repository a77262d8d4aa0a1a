/* Starts other programs. */
#ifndef TRIP_START_PROGRAM_H
#define TRIP_START_PROGRAM_H

#include <spawn.h>
#include <sys/types.h>

/* Starts a program, which is found by PATH, like posix_spawnp(). SIGPIPE ends it as usual, even if
 * this program ignores the signal. Destroys `actions`. Returns 0 or an error number. */
int trip_start_program(pid_t *process, posix_spawn_file_actions_t *actions, char *const *arguments);

#endif
