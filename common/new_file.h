/* A file that takes its name only when it is complete: until then it has a random one beside it, so
 * that a failure leaves what was there, and what a killed process left behind is in nobody's way.
 * What is replaced hands on its mode; a symbolic link is replaced, not followed. One thread. */
#ifndef TRIP_NEW_FILE_H
#define TRIP_NEW_FILE_H

#include <limits.h>

typedef struct trip_new_file {
    const char *what, *path; /* the caller's */
    char temporary[PATH_MAX];
    int fd; /* open for reading and writing; -1 when there is none */
} trip_new_file;

/* `what` begins the lines about it ("write"); it and `path` must outlive the file. 0, or a reported
 * failure, after which there is nothing to end. */
int trip_new_file_begin(trip_new_file *f, const char *what, const char *path);
/* Whether a file could be made there, for work that is long: a reported failure where its folder is
 * missing or not to be written in, or where the path is a folder's. Makes nothing. */
int trip_new_file_check(const char *what, const char *path);
/* Gives the file its name; a reported failure leaves nothing. */
int trip_new_file_finish(trip_new_file *f);
/* Removes it, unless it is finished. */
void trip_new_file_abandon(trip_new_file *f);

#endif
