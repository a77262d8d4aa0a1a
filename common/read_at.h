/* Reads a part of a file. Any thread. */
#ifndef TRIP_READ_AT_H
#define TRIP_READ_AT_H

#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

/* Reads from `offset` on until at least `least` of `bytes` bytes are read or the file ends; returns
 * how many were read, or -1 with errno. Reading in whole sectors beyond the end of a file, as
 * direct I/O needs it, has `least` below `bytes`. */
ssize_t trip_read_at(int fd, void *to, size_t bytes, size_t min, uint64_t offset);

#endif
