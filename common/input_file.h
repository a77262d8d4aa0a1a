/* Reads small files given by name, which may be pipes ("<(command)"): reading waits for their
 * writer until an interruption. Any thread. */
#ifndef TRIP_INPUT_FILE_H
#define TRIP_INPUT_FILE_H

#include <stddef.h>
#include <sys/types.h>

/* Opens for reading without waiting for the writer of a pipe. -1 with errno on failure. */
int trip_input_open(const char *path);

/* Reads up to `bytes` bytes, fewer only at the end. -1 with errno on failure, EINTR after an
 * interruption. */
ssize_t trip_input_read(int fd, void *to, size_t bytes);

#endif
