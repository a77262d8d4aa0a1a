/* What `view` and `serve` show where the user names a volume: its data set in the cache, made there
 * first. For the drawing thread, but for viewed_volume_make(). */
#ifndef TRIP_CLI_VIEWED_VOLUME_H
#define TRIP_CLI_VIEWED_VOLUME_H

#include <stdbool.h>

#include "cached_volume.h"

typedef struct viewed_volume {
    triptych_brick_options options; /* how a volume is read, memory and threads; nothing else */
    const char *function;           /* that is to be shown, or NULL */
    /* The volume that --error is for, and the data set that its report is of, as in
     * quality_options.h; NULL: none. */
    const char *measured_volume, *measured;
    bool samples;         /* of large volumes that are not in the cache a small one is found,
                             of samples */
    cached_volume cached; /* zeroed at first */
} viewed_volume;

/* What can be known before anything is shown: that a data set opens and takes the function, that a
 * volume is there in a format that is known, and that there is such a function. The context has
 * none open before and after. */
int viewed_volume_check(const viewed_volume *s, triptych *t, const char *input,
                        const triptych_resources *resources);

/* As trip_frames_params.find and release have them; `user` is a viewed_volume. */
int viewed_volume_find(void *user, triptych *t, const char *input, bool keep_all, bool *small,
                       const char **path);
void viewed_volume_release(void *user);
/* What viewed_volume_find() then finds, with all values or those that are to be shown; by a thread
 * of its own, as trip_maker_params.make has it. */
int viewed_volume_make(void *user, triptych *t, const char *input, bool keep_all);

#endif
