/* Removes files of a folder. Their names disappear at once. Some file systems take seconds to free
 * large files, and no signal can end a process meanwhile. */
#ifndef TRIP_REMOVE_FILES_H
#define TRIP_REMOVE_FILES_H

#include <stdbool.h>

/* If the files have more bytes in total, a separate process frees them. The caller waits for it,
 * until the work is cancelled (scope.h). */
#define TRIP_REMOVE_APART_BYTES (64 << 20)

/* Removes the files for which `ours` returns true. Does not report failures. Any thread. */
void trip_remove_files(int folder, bool (*ours)(const char *name));

#endif
