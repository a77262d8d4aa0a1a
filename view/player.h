/* Plays a script in the window, one event at a time. After each event the window is drawn, so that
 * a control is in place before it is pressed. The window's thread only. */
#ifndef TRIP_VIEW_PLAYER_H
#define TRIP_VIEW_PLAYER_H

#include "script.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_player {
    trip_script script;
    size_t next;        /* index of the next event */
    uint64_t state;     /* of the random generator */
    uint64_t left;      /* random events still to come */
    double until;       /* end of the sleep, seconds */
    int phase;          /* step of an event that takes several pictures */
    double since;       /* start of the event, seconds */
    double position[2]; /* of the control in the previous picture */
    int width, height;  /* of the window, px, for random events */
    const char *drops;  /* file that random events drop; may be NULL */
} trip_player;

/* Callbacks of the window. */
typedef struct trip_player_window {
    void *user;
    void (*send)(void *user, const trip_event *e); /* sends an event as from a person */
    bool (*rests)(void *user);                     /* whether the picture is complete */
    bool (*has_size)(void *user, int width, int height);
    /* Finds the box of a control of the panel. */
    bool (*find)(void *user, const char *label, double box[4]);
    void (*shoot)(void *user, const char *path); /* saves the window's next picture */
    void (*save)(void *user, const char *path);  /* saves the full picture */
    int (*saved)(void *user); /* once idle: 0, or the reported failure of save() */
    int (*report)(void *user, const char *path); /* writes the statistics */
} trip_player_window;

/* Plays one event or a part of it. `seconds` is the time of any steady clock. Returns 1 if events
 * remain, 0 after the last one, or a reported failure if a control or file is missing. */
int trip_player_step(trip_player *p, const trip_player_window *w, double seconds);

/* Returns a random event of the kinds that people make. Its text is not owned. */
trip_event trip_player_random(uint64_t *state, int width, int height);

#ifdef __cplusplus
}
#endif

#endif
