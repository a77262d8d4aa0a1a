/* The viewer in a browser: a server of HTTP that draws here what is shown there. It answers this
 * machine alone, and those alone who have the token of its address. Main thread only. */
#ifndef TRIP_SERVE_H
#define TRIP_SERVE_H

#include "frames.h"

/* Zero means the default. */
typedef struct trip_serve_params {
    const char *input;        /* a data set, or what `find` makes one of */
    int port;                 /* 0: one that is free */
    double frames_per_second; /* while the view moves; 0: 30 */
    uint64_t memory_bytes;    /* these as triptych_resources */
    unsigned threads;
    triptych_renderer renderer;
    triptych_engine engine;
    const char *function;
    const char *heat; /* the data set of its heat; NULL: none */
    triptych_settings settings;
    /* Called once with the address to open, until the next interruption. */
    void (*ready)(void *user, const char *address);
    void *user;
    /* As frames.h has them; NULL: the input is a data set. */
    int (*find)(void *user, triptych *t, const char *input, bool keep_all, bool *small,
                const char **path);
    void (*release)(void *user);
    void *find_user;
} trip_serve_params;

/* Until the program is interrupted, which is no failure: 0, or a reported failure. */
int trip_serve_run(const trip_serve_params *params);

#endif
