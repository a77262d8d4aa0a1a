/* Writes the metadata of a data set: JSON that describes its source and the kept values.
 * render/dataset_metadata.h lists the keys that drawing uses. The text does not depend on memory,
 * threads or time. */
#ifndef TRIP_BRICK_METADATA_H
#define TRIP_BRICK_METADATA_H

#include "brick_params.h"
#include "envelope.h"
#include "orientation.h"
#include "scan.h"

typedef struct trip_brick_metadata {
    const trip_brick_params *params;
    const trip_volume_info *info;
    const trip_envelope *envelope;
    trip_tf *const *functions; /* params->function_count transfer functions, in data units */
    const trip_histogram *histogram;
    const trip_tally *tally;
    const trip_fills *fills;  /* given or found */
    trip_orientation upright; /* none if the file or its format gives the orientation */
} trip_brick_metadata;

/* Returns the kind of a volume, recognised from its header and histogram, never TRIP_TF_AUTOMATIC.
 */
trip_tf_kind trip_brick_kind(const trip_volume_info *info, const trip_histogram *h);

/* Returns the source of the orientation of a volume, a key of FORMAT.md. "values" stands for a
 * guess from the values, which bricking makes. */
const char *trip_brick_orientation(const trip_volume_info *info, const trip_volume_params *params);

/* Writes the note for the user: the reader's choices, and the orientation guessed from the shape.
 * "" if there is none. */
enum { TRIP_BRICK_NOTE_BYTES = 1536 };
void trip_brick_metadata_note(const trip_brick_metadata *t, char note[TRIP_BRICK_NOTE_BYTES]);

/* Returns the metadata, for free(), or NULL after a reported failure. */
char *trip_brick_metadata_make(const trip_brick_metadata *t);

#endif
