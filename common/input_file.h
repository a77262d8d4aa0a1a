/* Small files given by name, which may be pipes ("<(command)"): reading them waits for the other
 * end, but not beyond a signal to stop. Any thread. */
#ifndef TRIP_INPUT_FILE_H
#define TRIP_INPUT_FILE_H

#include <stddef.h>
#include <sys/types.h>

/* Opens for reading, without waiting for who writes to a pipe. -1 with errno where it cannot be. */
int trip_input_open(const char *path);

/* Reads up to `bytes` bytes, fewer only at the end. -1 with errno on failure, which is EINTR once
 * trip_interrupted(). */
ssize_t trip_input_read(int fd, void *to, size_t bytes);

#endif
