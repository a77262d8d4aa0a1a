/* What the files of frames.h share: the mailbox, under its lock, and what the drawing thread alone
 * uses. */
#ifndef TRIP_VIEW_FRAMES_STATE_H
#define TRIP_VIEW_FRAMES_STATE_H

#include <pthread.h>

#include "frames.h"
#include "pace.h"
#include "scope.h"

struct trip_frames {
    trip_frames_params params; /* constant */
    pthread_t thread;
    trip_scope scope; /* the thread's */
    triptych *t;      /* the thread's, but for triptych_cancel() */

    pthread_mutex_t lock;
    pthread_cond_t come;
    /* Under lock: */
    trip_wanted wanted;
    uint64_t wanted_count; /* how often something was wanted */
    bool quit;
    bool ends_early; /* what goes on is given up for what comes */
    char *save;      /* a file to write the whole picture to; NULL: none */
    trip_frames_status status;
    float times[TRIP_FRAMES_TIMES]; /* round */
    trip_opened opened;
    bool has_opened;
    char *plan;
    bool looks; /* at a place: */
    double position[2];
    trip_probed probed;

    /* The window looks at it only where it gets this lock at once; the drawing thread holds it only
     * while it copies a picture. */
    pthread_mutex_t picture_lock;
    trip_picture picture;

    /* The drawing thread's own. */
    trip_wanted now; /* what it works on */
    uint64_t taken;  /* wanted_count when that was wanted; of what was worked on last: */
    uint64_t served;
    bool small;                 /* as find() says */
    bool cold;                  /* its heat cannot be had */
    bool open, announced, warm; /* a data set; to the window; a frame of it was drawn */
    bool frugal;                /* no pages are kept between frames of it */
    bool plain;                 /* and moving views have no coarse levels */
    bool by_values;             /* it has those of values alone: moving views are drawn by these */
    unsigned document;
    const char *source;  /* that was found for what is named; NULL: nothing is held */
    char *function;      /* that the context has, as a key */
    bool other_function; /* than the window's thread was given the text of */
    bool has_settings;
    triptych_settings settings; /* that the context has */
    float *rgba;                /* of this size: */
    int width, height;
    uint8_t *shown;             /* the picture's pixels */
    trip_pace pace, whole_pace; /* of frames of moving views; of whole pictures */
    bool whole;                 /* rgba is the whole picture of what is wanted */
    double shown_ms;            /* when a picture was last shown */
};

/* Before the drawing thread starts: what may be given up from then on. */
void trip_frames_prepare(trip_frames *f);
/* The drawing thread; `user` is the trip_frames. */
void *trip_frames_run(void *user);

/* Copies texts; release it. False without memory. */
bool trip_wanted_copy(trip_wanted *to, const trip_wanted *from);
void trip_wanted_release(trip_wanted *w);

#endif
