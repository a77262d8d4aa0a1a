/* Draws several frames of a sequence at once, each by a thread with a context of its own. The disk
 * and the processors then stay busy while a frame waits or its picture is written. The contexts
 * share the memory equally. Pictures are bit-identical to pictures drawn one by one. */
#ifndef TRIP_CLI_FLIGHT_H
#define TRIP_CLI_FLIGHT_H

#include "placed_input.h"
#include "sequence.h"

typedef struct flight {
    const render_options *o;
    const sequence *sequence;
    const char *data; /* path of the data set */
    const placed_input *placed;
    int contexts;
    /* write() writes a frame's picture and distances (NULL without --depth). Any thread calls it,
     * in any order. then() runs once for each frame, in the order of the frames, never twice at
     * once. Both return 0 or a failure that they have reported through the context or
     * trip_fail(). */
    int (*write)(void *user, triptych *t, int frame, const float *rgba, const float *depth);
    int (*then)(void *user, triptych *t, int frame, const float *rgba);
    void *user;
} flight;

/* Draws all frames, and sets *done to the number of complete frames from the first on. Returns 0, a
 * reported failure, or 1 if the caller may still draw the other frames one by one with all of the
 * memory. */
int flight_draw(const flight *f, int *done);

#endif
