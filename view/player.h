/* Plays a script in the window: an event at a time, each followed by a picture of the window, so
 * that what is under the pointer is there when it is pressed. The window's thread only. */
#ifndef TRIP_VIEW_PLAYER_H
#define TRIP_VIEW_PLAYER_H

#include "script.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_player {
    trip_script script;
    size_t next;        /* event */
    uint64_t state;     /* of the chances of the random events under way, */
    uint64_t left;      /* so many to come */
    double until;       /* that is slept to, in seconds */
    int phase;          /* of an event that takes several pictures */
    double since;       /* that began */
    double position[2]; /* where a control was a picture ago */
    int width, height;  /* of the window, for random events */
    const char *drops;  /* what random events drop; NULL: nothing */
} trip_player;

/* What the window does for it. */
typedef struct trip_player_window {
    void *user;
    void (*send)(void *user, const trip_event *e); /* as people's */
    bool (*rests)(void *user);                     /* the picture is whole */
    bool (*has_size)(void *user, int width, int height);
    /* Where a control of the panel lies. */
    bool (*find)(void *user, const char *label, double box[4]);
    void (*shoot)(void *user, const char *path); /* the window, when it is next drawn */
    void (*save)(void *user, const char *path);  /* the picture */
    int (*saved)(void *user); /* once it rests: 0, or a failure to save that, reported */
    int (*report)(void *user, const char *path); /* the status */
} trip_player_window;

/* One event, or a part of it; `seconds` is the time by any clock. 1: there are more; 0: that was
 * the last one; a reported failure: something that was to be there is not. */
int trip_player_step(trip_player *p, const trip_player_window *w, double seconds);

/* An event by chance, of those that people make; it has no text of its own. */
trip_event trip_player_random(uint64_t *state, int width, int height);

#ifdef __cplusplus
}
#endif

#endif
