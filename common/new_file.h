/* A file that gets its name only when it is complete; before, it has a random name in the same
 * folder. So a failure leaves an existing file as it was, and what a killed process leaves does not
 * disturb later runs. A file that is replaced passes on its mode; a symbolic link is replaced, not
 * followed; devices, pipes and sockets are not replaced. One thread. */
#ifndef TRIP_NEW_FILE_H
#define TRIP_NEW_FILE_H

#include <limits.h>

typedef struct trip_new_file {
    const char *stage, *path; /* the caller's */
    char temporary[PATH_MAX];
    int fd; /* open for reading and writing; -1 when there is none */
} trip_new_file;

/* Creates the file. `what` begins the messages about it ("write"); it and `path` must outlive *f.
 * After a reported failure there is nothing to finish or to abandon. */
int trip_new_file_begin(trip_new_file *f, const char *stage, const char *path);
/* Checks before long work that a file can be made there: reports a failure if the folder is missing
 * or not writable, or if the path is that of a folder, a device, a pipe or a socket. Creates
 * nothing. */
int trip_new_file_check(const char *stage, const char *path);
/* Gives the file its name; a reported failure leaves nothing. */
int trip_new_file_finish(trip_new_file *f);
/* Removes it, unless it is finished. */
void trip_new_file_abandon(trip_new_file *f);

/* Makes a file of a text, which is on the disk when it gets its name. */
int trip_new_file_of_text(const char *stage, const char *path, const char *text);

#endif
