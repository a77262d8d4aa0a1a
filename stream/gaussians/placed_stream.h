/* The splats of several Gaussian scenes in one order of a key. A placement maps each scene into the
 * common space, which the key and the planes refer to. The placed splats come in exact ascending
 * order of their keys; equal keys come in the order of the sets, then as gaussian_stream.h says.
 *
 * A key is an affine function of the centre. In the space of a set it is one too, so each set has a
 * gaussian_stream.h of its own, and this stream merges them. A set is open only while its range of
 * keys lasts. One thread. */
#ifndef TRIP_PLACED_STREAM_H
#define TRIP_PLACED_STREAM_H

#include "gaussian_stream.h"
#include "gaussian_transform.h"

/* Changes a splat in the space of its set, before it is placed. Any thread. NULL: nothing. */
typedef struct trip_gaussian_change {
    void (*change)(const void *context, trip_gaussian *g);
    const void *context;
} trip_gaussian_change;

static inline void trip_gaussian_change_apply(const trip_gaussian_change *c, trip_gaussian *g)
{
    if (c->change)
        c->change(c->context, g);
}

typedef struct trip_placed_set {
    trip_gaussian_set *set;            /* only read here */
    trip_gaussian_transform placement; /* a similarity (`even`) */
    trip_gaussian_change change;
} trip_placed_set;

/* Sets an affine function of the set's space from one of the common space:
 * direction * position + offset. */
void trip_place_function(const trip_gaussian_transform *t, const double from[3], double offset,
                         double direction[3], double *placed_offset);
/* Moves the eye of levels of detail from the common space into the set's space. */
void trip_place_lod(trip_gaussian_lod *lod, const trip_gaussian_transform *t);
/* Returns the axis of the set's space that is nearest to an axis of the common space. */
int trip_place_axis(const trip_gaussian_transform *t, int axis);

typedef struct trip_placed_stream trip_placed_stream;

/* Fails before it reads anything if the budget is too small for the sets that are open together.
 * `sets` must outlive the stream. The axis of `params` is one of the common space. If `drawn` is
 * not NULL, drawn[i] grows by the splats of set i that the stream delivers. */
int trip_placed_stream_open(trip_placed_stream **out, const trip_placed_set *sets, unsigned count,
                            const trip_gaussian_stream_params *params, uint64_t *drawn,
                            trip_budget *budget);
/* Like trip_gaussian_stream_next(). */
int trip_placed_stream_next(trip_placed_stream *s, trip_gaussian *out, double *keys, size_t room,
                            size_t *got);
/* The sums over the sets. Windows and memory count the sets that are open together. */
const trip_gaussian_plan *trip_placed_stream_planned(const trip_placed_stream *s);
/* The sums over the sets. */
trip_gaussian_progress trip_placed_stream_progress(const trip_placed_stream *s);
void trip_placed_stream_close(trip_placed_stream *s); /* NULL is allowed */

#endif
