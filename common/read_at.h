/* Reads part of a file. Any thread. */
#ifndef TRIP_READ_AT_H
#define TRIP_READ_AT_H

#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

/* Reads from `offset` until at least `min` of `bytes` bytes are read or the file ends. Returns the
 * number of bytes read, or -1 with errno. Direct I/O reads whole sectors, beyond the end of the
 * file, with `min` below `bytes`. */
ssize_t trip_read_at(int fd, void *to, size_t bytes, size_t min, uint64_t offset);

#endif
