/* Finds or makes the data sets of the volumes that `view` and `serve` show. The drawing thread
 * calls these functions, except viewed_volume_make(). */
#ifndef TRIP_CLI_VIEWED_VOLUME_H
#define TRIP_CLI_VIEWED_VOLUME_H

#include <stdbool.h>

#include "cached_volume.h"
#include "placed_input.h"
#include "quality_options.h"

typedef struct viewed_volume {
    triptych_brick_options options; /* only the fields for reading a file, memory and threads are
                                       set */
    const char *function;           /* transfer function to show, or NULL */
    /* The volume that --error applies to, and the checksum of the measured data set (see
     * quality_options.h). NULL without --error. */
    const char *measured_volume, *measured;
    const draw_settings *settings; /* of the command line */
    bool samples; /* true: for a large volume that is not in the cache, first finds a small data set
                     from samples */
    cached_volume cached; /* zeroed before its first use */
    placed_input placed;  /* of a scene file; zeroed before its first use */
} viewed_volume;

/* Takes the settings of --error, and selects the coarse levels for bricking. `q` must outlive *s.
 */
int viewed_volume_choose(viewed_volume *s, quality_options *q, const char *input,
                         draw_settings *settings, triptych_renderer *renderer);

/* Checks the inputs before anything is shown. All settings must apply to a volume or to a Gaussian
 * scene. A data set must open and accept the transfer function. A volume must exist in a known
 * format, and its transfer function must load. This holds for each object of a scene file. The
 * context has no data set open before the call or after it. */
int viewed_volume_check(const viewed_volume *s, triptych *t, const char *input,
                        const triptych_resources *resources);

/* Callbacks for trip_frames_params.find and release. `user` is a viewed_volume. */
int viewed_volume_find(void *user, triptych *t, const char *input, bool keep_all, bool *small,
                       const char **path);
void viewed_volume_release(void *user);
/* Callback for trip_frames_params.open: opens a data set, or the objects of a scene file. */
int viewed_volume_open(void *user, triptych *t, const char *path,
                       const triptych_resources *resources);
/* Callback for trip_maker_params.make, in a thread of its own. Makes the data set that
 * viewed_volume_find() returns next, with all values or only the visible ones. */
int viewed_volume_make(void *user, triptych *t, const char *input, bool keep_all);

#endif
