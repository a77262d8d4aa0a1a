/* A flight by the viewer's drawing thread (view/frames.h) without a window: input comes in equal
 * steps of time, as from a hand that moves a mouse, and when which picture of it came is kept. One
 * thread. */
#ifndef TRIP_BENCH_FLYER_H
#define TRIP_BENCH_FLYER_H

#include <pthread.h>

#include "frames.h"

enum {
    FLYER_STEPS_PER_SECOND = 60,
    /* Equally long: round the object, nearer to it, through it, looking about while going back. */
    FLYER_PARTS = 4,
};

/* A picture that came while the eye moved. */
typedef struct flyer_picture {
    double ms;     /* when, since the eye began to move */
    int step;      /* of the input that it is of */
    int latest;    /* step that had come when the picture before it came, which was then drawn */
    double age_ms; /* of that input */
    double scale;  /* of the width and height that were wanted */
} flyer_picture;

typedef struct flyer {
    trip_frames *frames;
    trip_wanted wanted;
    trip_opened opened;
    pthread_mutex_t lock;
    pthread_cond_t woken;
    bool woke; /* under lock */

    int steps; /* of input, of which so many are there: */
    int step_count;
    trip_navigation *navigation; /* of each */
    double *wanted_ms;           /* when it came */
    flyer_picture *pictures;
    int picture_count, picture_room;
    uint64_t number;                          /* of the last picture */
    double begun_ms;                          /* the eye to move, by the clock */
    double first_ms, first_whole_ms, rest_ms; /* since the data set was opened; since it rested */
    uint8_t *last;                            /* the picture at rest, 4 bytes a pixel */
} flyer;

/* Opens the data set, waits until the picture is whole, and flies for so many seconds, then waits
 * again. Failures are reported. End it also after one. */
int flyer_fly(flyer *f, const trip_frames_params *params, const trip_wanted *wanted,
              double seconds);
/* The drawing thread ends, and with it what it took; the figures stay. */
void flyer_land(flyer *f);
void flyer_release(flyer *f);

#endif
