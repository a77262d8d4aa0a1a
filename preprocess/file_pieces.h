/* Reads a plain file as fast as the disk can, with several large requests at a time. What the page
 * cache holds is taken from there; the rest is read with direct I/O, which leaves the page cache to
 * others. One thread calls; it starts others for the duration of a read. */
#ifndef TRIP_FILE_PIECES_H
#define TRIP_FILE_PIECES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct trip_file_pieces trip_file_pieces;

/* `path` is open as `fd`, which remains the caller's. NULL, with nothing reported, where the file
 * system has no direct I/O or memory runs out. */
trip_file_pieces *trip_file_pieces_create(const char *path, int fd, uint64_t file_bytes);
void trip_file_pieces_destroy(trip_file_pieces *p);

/* False after any failure or interruption, with nothing reported: the caller reads in another way,
 * which reports the cause. */
bool trip_file_pieces_read(trip_file_pieces *p, uint64_t offset, void *to, size_t bytes);

#endif
