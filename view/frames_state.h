/* The state of trip_frames, shared by frames.c and frames_thread.c: the mailbox under its lock, and
 * the drawing thread's own members. */
#ifndef TRIP_VIEW_FRAMES_STATE_H
#define TRIP_VIEW_FRAMES_STATE_H

#include <pthread.h>

#include "frames.h"
#include "pace.h"
#include "scope.h"

struct trip_frames {
    trip_frames_params params; /* read-only */
    pthread_t thread;
    trip_scope scope; /* the thread's */
    triptych *t;      /* the thread's; others only call triptych_cancel() */

    pthread_mutex_t lock;
    pthread_cond_t come;
    /* Under lock: */
    trip_wanted wanted;
    uint64_t wanted_count; /* counts changes of `wanted` */
    bool quit;
    bool ends_early; /* new wishes abandon the frame in progress */
    char *save;      /* file to write the full picture to; may be NULL */
    trip_frames_status status;
    float times[TRIP_FRAMES_TIMES]; /* ring buffer */
    trip_opened opened;
    bool has_opened;
    char *plan;
    bool looks; /* a probe is wanted, at `position` */
    double position[2];
    trip_probed probed;

    /* The window's thread only tries this lock. The drawing thread holds it only while it copies a
     * picture. */
    pthread_mutex_t picture_lock;
    trip_picture picture;

    /* Private to the drawing thread: */
    trip_wanted now;            /* the wish it works on */
    uint64_t taken;             /* wanted_count of `now` */
    uint64_t served;            /* wanted_count of the previous wish */
    bool small;                 /* as find() set it */
    bool cold;                  /* the heat data set failed to open */
    bool open, announced, warm; /* a data set is open; the window knows; a frame was drawn */
    bool is_scene;              /* the open data set is a Gaussian scene */
    bool frugal;                /* keeps no pages between frames */
    bool plain;                 /* moving views have no coarse levels */
    bool by_values;             /* has coarse levels for post only: moving views use post */
    unsigned document;
    const char *source;  /* path from find(); NULL if nothing is held */
    char *function;      /* key of the context's transfer function */
    bool other_function; /* the window does not have its text yet */
    bool has_settings;
    draw_settings settings; /* of the context */
    float *rgba;            /* width * height pixels */
    int width, height;
    uint8_t *shown;             /* pixels of `picture` */
    trip_pace pace, whole_pace; /* of moving frames; of full pictures */
    bool awaits_choice;         /* the full picture has the defaults until triptych_choose() */
    bool whole;                 /* rgba is the full picture of the wanted view */
    double shown_ms;            /* time of the last shown picture */
    double woken_ms;            /* time of the last shown progress */
    double taken_ms;            /* the last part of a picture took this long */
};

/* Prepares the state that other threads may cancel. Call it before the drawing thread starts. */
void trip_frames_prepare(trip_frames *f);
/* Entry of the drawing thread; `user` is the trip_frames. */
void *trip_frames_run(void *user);

/* Copies a wish with its texts. Returns false if memory is exhausted. Release the copy. */
bool trip_wanted_copy(trip_wanted *to, const trip_wanted *from);
void trip_wanted_release(trip_wanted *w);

#endif
