/* Prints the contents of a file that is no data and no volume, but that an option reads: a transfer
 * function, a camera path, a stored view, a script, a report. Main thread only. */
#ifndef OWN_FILE_INFO_H
#define OWN_FILE_INFO_H

#include <stdbool.h>

/* Returns whether a path is such a file. */
bool own_file_wanted(const char *path);
/* Returns a negative status after a reported failure. */
int own_file_info(const char *path, bool json);

#endif
