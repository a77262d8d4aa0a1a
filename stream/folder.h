/* The folder a data set grows in, `NAME.trip.partial`, and how it takes its final name in one step.
 * Only files that belong to a data set are ever removed. Used by the writer; one thread. */
#ifndef TRIP_FOLDER_H
#define TRIP_FOLDER_H

#include <stdbool.h>

/* Unnamed files have this name for the moment between their creation and their removal. */
#define TRIP_SPOOL_NAME "spool"

typedef struct trip_folder {
    char *path;    /* the final name, without slashes at its end */
    char *partial; /* what is written to */
    char *aside;   /* where an old data set goes if the file system cannot exchange names */
    bool replace;
    int fd; /* of the partial folder; holds the lock that keeps other writers out */
} trip_folder;

/* Makes the partial folder, empty: what an interrupted run left there is removed. */
int trip_folder_begin(trip_folder *f, const char *path, bool replace);
/* The partial folder becomes the data set. Under the name stands the old or the new one, complete,
 * at every moment; on file systems that cannot exchange names there is an instant with neither, and
 * the old one comes back at the next begin if the machine stops just then. */
int trip_folder_commit(trip_folder *f);
/* Removes the partial folder if it is still there, and frees. */
void trip_folder_close(trip_folder *f);

#endif
