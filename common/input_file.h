/* Reads small files given by name. They may be pipes ("<(command)"); reading then waits for the
 * writer until an interruption. Any thread. */
#ifndef TRIP_INPUT_FILE_H
#define TRIP_INPUT_FILE_H

#include <stddef.h>
#include <sys/types.h>

/* Opens a file for reading, without waiting for the writer of a pipe. Returns -1 with errno on
 * failure. */
int trip_input_open(const char *path);

/* Reads up to `bytes` bytes, fewer only at the end of the file. Returns -1 with errno on failure,
 * with EINTR after an interruption. */
ssize_t trip_input_read(int fd, void *to, size_t bytes);

#endif
