/* Describes the files that options read: transfer functions, camera paths, stored views, scripts
 * and reports. Main thread only. */
#ifndef OWN_FILE_INFO_H
#define OWN_FILE_INFO_H

#include <stdbool.h>

/* Returns whether a path is such a file. */
bool own_file_wanted(const char *path);
/* Returns a negative status after a reported failure. */
int own_file_info(const char *path, bool json);

#endif
