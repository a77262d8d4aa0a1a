/* The frames that `triptych render` draws: one frame, an orbit, or a camera path. The keys of a
 * path may have transfer functions. A prepared sequence is read-only, and any number of threads may
 * use it. */
#ifndef TRIP_CLI_SEQUENCE_H
#define TRIP_CLI_SEQUENCE_H

#include "camera_path.h"
#include "render_options.h"
#include "transfer_function.h"

typedef struct sequence {
    const render_options *o;
    int frames;
    trip_camera_path path;    /* without keys if no path is given */
    trip_navigation *cameras; /* of each frame, after sequence_prepare() */
    trip_tf **functions;      /* default first, then of each key; NULL if the key has none */
    /* Transfer functions that bricking takes into account: the names of presets and files, and the
     * visible value ranges of transfer functions given as text. */
    const char **names;
    triptych_range *ranges;
    size_t name_count, range_count;
} sequence;

/* Reads the path's file. *s is zeroed before. */
int sequence_load(sequence *s, const render_options *o);
/* Fills names and ranges for bricking. */
int sequence_find_shown(sequence *s);
/* Returns whether a key of the path has a transfer function. */
bool sequence_has_functions(const sequence *s);
/* Sets the view of the options, unless there is a path. */
int sequence_set_view(const sequence *s, triptych *t);
/* Computes all cameras and transfer functions, and prints the warnings for transfer functions. The
 * context must have its data set, transfer function and view. */
int sequence_prepare(sequence *s, triptych *t);
void sequence_release(sequence *s);

double sequence_frames_per_second(const sequence *s);

/* Sets a frame's view and, for a path, its transfer function and clipping. Prints no warnings.
 * `quiet`: the context already prints no messages. */
int sequence_set_frame(const sequence *s, triptych *t, int frame, bool quiet);

#endif
