/* Flies through a data set with the viewer's drawing thread (view/frames.h), without a window.
 * Input comes in equal steps of time, like from a moving mouse. The flyer notes the time and the
 * step of each picture. One thread. */
#ifndef TRIP_BENCH_FLYER_H
#define TRIP_BENCH_FLYER_H

#include <pthread.h>

#include "frames.h"

enum {
    FLYER_STEPS_PER_SECOND = 60,
    /* Four parts of equal length: around the object, nearer, through the object, and back while
     * looking around. */
    FLYER_PARTS = 4,
};

/* A picture that came while the eye moved. */
typedef struct flyer_picture {
    double ms;     /* time since the eye began to move */
    int step;      /* input step of the picture */
    int latest;    /* newest step when the previous picture came */
    double age_ms; /* time since the step of the picture */
    double scale;  /* drawn width / full width */
} flyer_picture;

typedef struct flyer {
    trip_frames *frames;
    trip_wanted wanted;
    trip_opened opened;
    pthread_mutex_t lock;
    pthread_cond_t woken;
    bool woke; /* guarded by lock */

    int steps; /* number of input steps; step_count of them have come */
    int step_count;
    trip_navigation *navigation; /* of each step */
    double *wanted_ms;           /* time of each step */
    flyer_picture *pictures;
    int picture_count, picture_room;
    uint64_t number; /* number of the last picture */
    double begun_ms; /* time of the first step */
    /* Times to the first and to the complete picture after opening, and to the complete picture
     * after the flight. */
    double first_ms, first_whole_ms, rest_ms;
    uint8_t *last; /* the picture at rest, 4 bytes per pixel */
} flyer;

/* Opens the data set, waits until the picture is complete, flies for `seconds`, and waits again.
 * Reports failures. The caller calls flyer_release() even after a failure. */
int flyer_fly(flyer *f, const trip_frames_params *params, const trip_wanted *wanted,
              double seconds);
/* Stops the drawing thread and frees its memory. The results stay. */
void flyer_land(flyer *f);
void flyer_release(flyer *f);

#endif
