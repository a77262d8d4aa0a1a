/* Creates a file that gets its name only when it is complete. Until then it has a random name in
 * the same folder. A failure thus leaves an existing file unchanged, and the remains of a killed
 * process do not disturb later runs. A replaced file passes on its mode. A symbolic link is
 * replaced, not followed. Devices, pipes and sockets are not replaced. One thread. */
#ifndef TRIP_NEW_FILE_H
#define TRIP_NEW_FILE_H

#include <limits.h>

typedef struct trip_new_file {
    const char *stage, *path; /* owned by the caller */
    char temporary[PATH_MAX];
    int fd; /* open for reading and writing, or -1 */
} trip_new_file;

/* Creates the file. `stage` starts its messages ("write"). `stage` and `path` must outlive *f.
 * After a reported failure, do not call finish or abandon. */
int trip_new_file_begin(trip_new_file *f, const char *stage, const char *path);
/* Checks before long work whether a file can be created. Reports a failure if the folder is missing
 * or not writable, or if the path is a folder, a device, a pipe or a socket. Creates nothing. */
int trip_new_file_check(const char *stage, const char *path);
/* Gives the file its name. A reported failure leaves no file. */
int trip_new_file_finish(trip_new_file *f);
/* Removes the file, unless it is finished. */
void trip_new_file_abandon(trip_new_file *f);

/* Creates a file with this text. The text is on the disk before the file gets its name. */
int trip_new_file_of_text(const char *stage, const char *path, const char *text);

#endif
