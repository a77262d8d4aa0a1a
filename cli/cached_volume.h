/* Finds a data set of a volume in the cache, or bricks the volume into it. The source of a data set
 * is a hash of the files' content and the options. A changed file therefore has other data sets,
 * and a copy has the same ones. The content is read once and remembered until the files' times
 * change. Files of more than 1 GiB in total are identified by path, size and times instead.
 *
 * Every data set of the source that keeps all wanted values serves, whatever it was made for. The
 * smallest of them is taken. Main thread only. */
#ifndef TRIP_CLI_CACHED_VOLUME_H
#define TRIP_CLI_CACHED_VOLUME_H

#include "cache_folder.h"
#include "library.h"

/* Zeroed before its first use. */
typedef struct cached_volume {
    char *path; /* of the data set */
    cache_key key;
    bool wider; /* the data set was made for other options, and keeps all wanted values */
    cache_folder folder;
    int hold;       /* a descriptor that protects the data set from removal */
    double seconds; /* time of bricking; 0 if the data set was in the cache */
} cached_volume;

/* The wanted data set. */
typedef struct cached_wish {
    triptych_brick_options options; /* to brick with, if no data set serves */
    /* If not NULL, a data set serves that holds the values that this function shows, even if
     * `options` keep every value. */
    const triptych_transfer_function *shown;
    const char *checksum; /* if neither NULL nor "", only a data set with this checksum serves */
} cached_wish;

/* Returns whether a command has to brick its input first: the input is not named NAME.trip, and is
 * not a folder with a data set. */
bool cached_volume_wanted(const char *input);
/* Fails if options for reading a volume were given for a data set. */
int cached_volume_check_options(const char *input);

/* Finds or makes a data set of `volume`. The context has no data set open before the call or after
 * it. The caller closes *v even after a failure. */
int cached_volume_open(cached_volume *v, triptych *t, const char *volume, const cached_wish *wish);
/* Returns 1 if the cache already holds such a data set, 0 if not, or a negative code after a
 * failure. */
int cached_volume_find(cached_volume *v, triptych *t, const char *volume, const cached_wish *wish);
void cached_volume_close(cached_volume *v);

/* Checks the data set after drawing failed, and removes it if it is damaged. Closes the context's
 * data set. */
void cached_volume_check(cached_volume *v, triptych *t, const char *volume);

#endif
