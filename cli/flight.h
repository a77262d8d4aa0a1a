/* Several frames of a sequence at once, each drawn by a context and thread of its own, so that the
 * disk and the processors have something to do while one of them is waited for, or its picture is
 * written. The contexts divide the memory; pictures are the same, bit for bit, as one by one. */
#ifndef TRIP_CLI_FLIGHT_H
#define TRIP_CLI_FLIGHT_H

#include "sequence.h"

typedef struct flight {
    const render_options *o;
    const sequence *sequence;
    const char *data; /* the data set */
    int contexts;
    /* Writes a frame's picture (and its distances, NULL without --depth), in any order, by any
     * thread; what comes after it, in the order of frames, one at a time. Both return 0 or a
     * failure, which the context reports or trip_fail() has. */
    int (*write)(void *user, triptych *t, int frame, const float *rgba, const float *depth);
    int (*then)(void *user, triptych *t, int frame, const float *rgba);
    void *user;
} flight;

/* Draws all frames; *done becomes how many of the first ones are complete. 0; 1 where the others
 * may still be drawn one by one, with all of the memory; or a reported failure. */
int flight_draw(const flight *f, int *done);

#endif
