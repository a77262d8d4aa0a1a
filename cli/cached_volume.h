/* Finds a volume's data set in the cache, or bricks the volume into it. The key is a hash of the
 * files' content and the options. A changed file therefore has another data set, and a copy has the
 * same one. The content is read once and remembered until the files' times change. Files of more
 * than 1 GiB in total are identified by path, size and times instead. Main thread only. */
#ifndef TRIP_CLI_CACHED_VOLUME_H
#define TRIP_CLI_CACHED_VOLUME_H

#include "cache_folder.h"
#include "library.h"

/* Zeroed before its first use. */
typedef struct cached_volume {
    char *path; /* of the data set */
    cache_key key;
    cache_folder folder;
    int hold;       /* a descriptor that protects the data set from removal */
    double seconds; /* time of bricking; 0 if the data set was in the cache */
} cached_volume;

/* Returns whether a command has to brick its input first: the input is not named NAME.trip, and is
 * not a folder with a data set. */
bool cached_volume_wanted(const char *input);
/* Fails if options for reading a volume were given for a data set. */
int cached_volume_check_options(const char *input);

/* Finds or makes the data set of `volume` for the options. The context has no data set open before
 * the call or after it. The caller closes *v even after a failure. */
int cached_volume_open(cached_volume *v, triptych *t, const char *volume,
                       const triptych_brick_options *options);
/* Returns 1 if the cache already holds the data set, 0 if not, or a negative code after a
 * failure. */
int cached_volume_find(cached_volume *v, triptych *t, const char *volume,
                       const triptych_brick_options *options);
void cached_volume_close(cached_volume *v);

/* Checks the data set after drawing failed, and removes it if it is damaged. Closes the context's
 * data set. */
void cached_volume_check(cached_volume *v, triptych *t, const char *volume);

#endif
