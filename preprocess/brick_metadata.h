/* The text of a data set, JSON that describes its source and what was kept;
 * render/dataset_metadata.h lists the keys that drawing uses. It does not depend on memory, threads
 * or time. */
#ifndef TRIP_BRICK_METADATA_H
#define TRIP_BRICK_METADATA_H

#include "brick.h"
#include "envelope.h"
#include "orientation.h"

typedef struct trip_brick_metadata {
    const trip_brick_params *params;
    const trip_volume_info *info;
    const trip_envelope *envelope;
    trip_tf *const *functions; /* params->function_count of them, in data units */
    const trip_histogram *histogram;
    trip_orientation
        upright; /* without any, where the file or its format says how the volume lies */
} trip_brick_metadata;

/* The kind of a volume, recognised from its header and histogram; never TRIP_TF_AUTOMATIC. */
trip_tf_kind trip_brick_kind(const trip_volume_info *info, const trip_histogram *h);

/* What the user is to be told of how the volume was taken: its reader's note, and what its
 * shape says of how it lies; "" where there is nothing. */
enum { TRIP_BRICK_NOTE_BYTES = 1024 };
void trip_brick_metadata_note(const trip_volume_info *info, trip_orientation upright,
                              char note[TRIP_BRICK_NOTE_BYTES]);

/* The text, for free(); NULL after a reported failure. */
char *trip_brick_metadata_make(const trip_brick_metadata *t);

#endif
