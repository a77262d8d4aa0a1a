/* A thread that makes a data set of a volume while another one is shown, one at a time: it is found
 * again, by the drawing thread's find(), once it is made. Functions are for the window's thread,
 * but for those of the params. */
#ifndef TRIP_VIEW_MAKER_H
#define TRIP_VIEW_MAKER_H

#include <stdbool.h>
#include <stdint.h>

#include "triptych.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_maker trip_maker;

typedef struct trip_maker_params {
    /* By its thread: 0 once find() would have it at once, or a failure, reported in the context or
     * the thread's scope. */
    int (*make)(void *user, triptych *t, const char *input, bool keep_all);
    void *user;
    void (*wake)(void *user); /* something has come; by its thread */
    void *wake_user;
} trip_maker_params;

/* NULL without memory. */
trip_maker *trip_maker_create(const trip_maker_params *params);
/* Gives up what is under way, which takes milliseconds. NULL is fine. */
void trip_maker_destroy(trip_maker *m);

/* For what the user named; false while something is made, or without a thread. */
bool trip_maker_start(trip_maker *m, unsigned document, const char *input, bool keep_all);

typedef struct trip_maker_status {
    bool busy;         /* until what was made is taken */
    unsigned document; /* that it is for */
    char stage[16];    /* what goes on, */
    double done;       /* 0 to 1 of that */
} trip_maker_status;

trip_maker_status trip_maker_get_status(trip_maker *m);

/* True once for each that has ended: whether it was made, else why not. */
typedef struct trip_made {
    unsigned document;
    bool keep_all;
    bool made;
    char message[512];
} trip_made;

bool trip_maker_take(trip_maker *m, trip_made *out);

#ifdef __cplusplus
}
#endif

#endif
