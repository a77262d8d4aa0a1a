/* A thread that bricks a volume in the background while the window shows another data set, one
 * volume at a time. The drawing thread's find() then finds the result. The window's thread calls
 * these functions; the callbacks of the params run on the maker's thread. */
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
    /* Called by the maker's thread. Returns 0 once find() would succeed at once, or a failure
     * reported in the context or the thread's scope. */
    int (*make)(void *user, triptych *t, const char *input, bool keep_all);
    void *user;
    void (*wake)(void *user); /* called when the status changed */
    void *wake_user;
} trip_maker_params;

/* Returns NULL if memory is exhausted. */
trip_maker *trip_maker_create(const trip_maker_params *params);
/* Abandons the work in progress, within milliseconds. Accepts NULL. */
void trip_maker_destroy(trip_maker *m);

/* Starts bricking the user's input. Returns false if the maker is busy or has no thread. */
bool trip_maker_start(trip_maker *m, unsigned document, const char *input, bool keep_all);

typedef struct trip_maker_status {
    bool busy;         /* until the result is taken */
    unsigned document; /* the work's document */
    char stage[16];    /* current stage */
    double done;       /* share of the stage, 0 to 1 */
} trip_maker_status;

trip_maker_status trip_maker_get_status(trip_maker *m);

/* The result of one run. If `made` is false, `message` gives the reason. */
typedef struct trip_made {
    unsigned document;
    bool keep_all;
    bool made;
    char message[512];
} trip_made;

/* Takes the result. Returns true once for each run that has ended. */
bool trip_maker_take(trip_maker *m, trip_made *out);

#ifdef __cplusplus
}
#endif

#endif
