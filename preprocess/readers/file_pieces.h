/* Reads a plain file at the disk's speed, with several large requests at once. It takes cached
 * pages from the page cache and reads the rest with direct I/O, which leaves the page cache to
 * others. One thread calls it; it starts others for the duration of a read. */
#ifndef TRIP_FILE_PIECES_H
#define TRIP_FILE_PIECES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct trip_file_pieces trip_file_pieces;

/* `fd` is `path`, opened and owned by the caller. Returns NULL, without a report, if the file
 * system lacks direct I/O or memory is exhausted. */
trip_file_pieces *trip_file_pieces_create(const char *path, int fd, uint64_t file_bytes);
void trip_file_pieces_destroy(trip_file_pieces *p);

/* Reads bytes. Returns false, without a report, after any failure or interruption. The caller then
 * reads in another way, which reports the cause. */
bool trip_file_pieces_read(trip_file_pieces *p, uint64_t offset, void *to, size_t bytes);

#endif
