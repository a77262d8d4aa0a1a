/* The folder `NAME.trip.partial`, in which a data set grows, and its renaming to the final name in
 * one step. Only files that belong to a data set are ever removed. Used by the writer; one thread.
 */
#ifndef TRIP_FOLDER_H
#define TRIP_FOLDER_H

#include <stdbool.h>
#include <sys/types.h>

/* Opens and locks a folder for temporary data, and creates it if needed. Reports a failure as
 * `stage` if it is a link, belongs to another user, or is locked by another process (with the
 * reason `busy`). */
int trip_folder_open_own(int *fd, const char *path, mode_t mode, const char *stage,
                         const char *busy);
/* Opens a file in such a folder; reports use `path` for the folder. A link, or a file that is not a
 * regular file of this user alone, is a reported failure. With O_CREAT in `flags`, a missing file
 * is created. Without it, a missing file is no failure, and *fd is -1. */
int trip_folder_open_file(int *fd, int folder, const char *path, const char *name, int flags,
                          const char *stage);

/* Template for mkostemp(). Unnamed files have such a name between their creation and their removal.
 */
#define TRIP_SPOOL_PREFIX "spool."
#define TRIP_SPOOL_NAME TRIP_SPOOL_PREFIX "XXXXXX"

typedef struct trip_folder {
    char *path;    /* final name, without slashes at its end */
    char *partial; /* folder that is written to */
    /* The old data set moves here if the file system cannot exchange names. */
    char *aside;
    bool replace;
    int fd; /* of the partial folder; holds the lock against other writers */
} trip_folder;

/* Checks before any work whether a data set may be written at `path`. Writing checks again. */
int trip_folder_check(const char *path, bool replace);
/* Creates an empty partial folder. Removes the remains of an interrupted run. */
int trip_folder_begin(trip_folder *f, const char *path, bool replace);
/* Renames the partial folder to the data set. At every moment, the name refers to the complete old
 * or new data set. On file systems that cannot exchange names, there is a short moment without
 * either. If the machine stops in that moment, the next begin restores the old data set. */
int trip_folder_commit(trip_folder *f);
/* Removes the partial folder if it still exists, and frees *f. */
void trip_folder_close(trip_folder *f);

#endif
