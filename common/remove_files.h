/* Removes files of a folder. Their names are gone at once; freeing the space of large ones takes
 * some file systems seconds, in which no signal ends the process that does it. */
#ifndef TRIP_REMOVE_FILES_H
#define TRIP_REMOVE_FILES_H

#include <stdbool.h>

/* Files of more bytes together are freed by a process made for that, which this one waits for until
 * its work is cancelled (scope.h). */
#define TRIP_REMOVE_APART_BYTES (64 << 20)

/* Removes the files that `ours` names. Failures are not reported. Any thread. */
void trip_remove_files(int folder, bool (*ours)(const char *name));

#endif
