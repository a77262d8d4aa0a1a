/* The frames that `triptych render` draws: one, those of an orbit, or those of a path of the
 * camera, whose keys may have transfer functions of their own. Read-only once it is prepared, for
 * any number of threads. */
#ifndef TRIP_CLI_SEQUENCE_H
#define TRIP_CLI_SEQUENCE_H

#include "camera_path.h"
#include "render_options.h"
#include "transfer_function.h"

typedef struct sequence {
    const render_options *o;
    int frames;
    trip_camera_path path;    /* without keys: none is given */
    triptych_camera *cameras; /* of the frames, once they are prepared */
    trip_tf **functions; /* of the path's keys, before them the default; NULL where it has none */
    /* What functions show, the command line's and the path's: those with names, and of the others
     * the values that they show. */
    const char **names;
    triptych_range *ranges;
    size_t name_count, range_count;
} sequence;

/* Zeroed at first; reads the path's file. */
int sequence_load(sequence *s, const render_options *o);
/* Finds what functions show, for bricking. */
int sequence_find_shown(sequence *s);
/* Whether the path has functions of its own. */
bool sequence_has_functions(const sequence *s);
/* Once the context has the data set, the function and the view. Warns of functions. */
int sequence_prepare(sequence *s, triptych *t);
void sequence_release(sequence *s);

double sequence_frames_per_second(const sequence *s);

/* A frame's view, and of a path its function, which is not warned of again. `quiet`: the context
 * reports nothing. */
int sequence_set_frame(const sequence *s, triptych *t, int frame, bool quiet);

#endif
