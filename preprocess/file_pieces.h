/* A plain file in large pieces, several at once: from the system's memory what it holds of the
 * file, the rest straight from the disk, so that reading is as fast as the disk and leaves that
 * memory alone. One thread calls; it starts others for the time of a read. */
#ifndef TRIP_FILE_PIECES_H
#define TRIP_FILE_PIECES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct trip_file_pieces trip_file_pieces;

/* Of the file that is open as `fd`, which stays the caller's. NULL where its file system knows no
 * direct I/O, or there is no memory: nothing is reported then. */
trip_file_pieces *trip_file_pieces_create(const char *path, int fd, uint64_t file_bytes);
void trip_file_pieces_destroy(trip_file_pieces *p);

/* False when anything went wrong, or the user wants to stop: to be read in some other way, which
 * will say what. */
bool trip_file_pieces_read(trip_file_pieces *p, uint64_t offset, void *to, size_t bytes);

#endif
