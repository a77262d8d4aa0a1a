/* A volume's data set in the cache: found there, or bricked into it first. What it is kept under is
 * the content of the volume's files and the options; so a changed file is another data set, and a
 * copy the same. The files' content is read once and remembered for as long as their times do not
 * change. Files of more than 1 GiB together are distinguished by place, size and times alone. */
#ifndef TRIP_CLI_CACHED_VOLUME_H
#define TRIP_CLI_CACHED_VOLUME_H

#include "cache_folder.h"
#include "library.h"

/* Zeroed at first. */
typedef struct cached_volume {
    char *path; /* of the data set */
    cache_key key;
    cache_folder folder;
    int hold;       /* keeps the data set from being removed */
    double seconds; /* that bricking took; 0 where it was there */
} cached_volume;

/* Whether the input of a command that draws is to be bricked: it is no folder with a data set in
 * it, and not named NAME.trip. */
bool cached_volume_wanted(const char *input);

/* The data set that bricking `volume` with the options makes. The context has none open before and
 * after. Close it also after a failure. */
int cached_volume_open(cached_volume *v, triptych *t, const char *volume,
                       const triptych_brick_options *options);
/* The same where it is there already: 1; else 0. */
int cached_volume_find(cached_volume *v, triptych *t, const char *volume,
                       const triptych_brick_options *options);
void cached_volume_close(cached_volume *v);

/* After drawing failed: removes the data set where it is damaged. Closes what the context has open.
 */
void cached_volume_check(cached_volume *v, triptych *t, const char *volume);

#endif
