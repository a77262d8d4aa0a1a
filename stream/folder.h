/* The folder a data set grows in, `NAME.trip.partial`, and how it takes its final name in one step.
 * Only files that belong to a data set are ever removed. Used by the writer; one thread. */
#ifndef TRIP_FOLDER_H
#define TRIP_FOLDER_H

#include <stdbool.h>
#include <sys/types.h>

/* Opens a folder for temporary data, which is made if it is not there, and locks it. Reports as
 * `what` and returns a negative status when it is a link, another user's, or when another process
 * has locked it (the reason given is `busy`). */
int trip_folder_open_own(int *fd, const char *path, mode_t mode, const char *stage,
                         const char *busy);
/* Opens a file in such a folder, `path` standing for the folder in reports. Links, and what is not
 * a regular file of this user's alone, are a reported failure. With O_CREAT in `flags` a missing
 * file is made; without it, that is no failure, and *fd is -1. */
int trip_folder_open_file(int *fd, int folder, const char *path, const char *name, int flags,
                          const char *stage);

/* Unnamed files have such a name, of mkostemp(), between their creation and their removal. */
#define TRIP_SPOOL_PREFIX "spool."
#define TRIP_SPOOL_NAME TRIP_SPOOL_PREFIX "XXXXXX"

typedef struct trip_folder {
    char *path;    /* the final name, without slashes at its end */
    char *partial; /* what is written to */
    char *aside;   /* where an old data set goes if the file system cannot exchange names */
    bool replace;
    int fd; /* of the partial folder; holds the lock that keeps other writers out */
} trip_folder;

/* Whether a data set may be written there, before any work is done; writing finds out again. */
int trip_folder_check(const char *path, bool replace);
/* Makes the partial folder, empty: what an interrupted run left there is removed. */
int trip_folder_begin(trip_folder *f, const char *path, bool replace);
/* The partial folder becomes the data set. Under the name stands the old or the new one, complete,
 * at every moment; on file systems that cannot exchange names there is an instant with neither, and
 * the old one comes back at the next begin if the machine stops just then. */
int trip_folder_commit(trip_folder *f);
/* Removes the partial folder if it is still there, and frees. */
void trip_folder_close(trip_folder *f);

#endif
