/* The viewer in a browser: an HTTP server that draws on this machine. It listens on 127.0.0.1 and
 * answers only requests with the token of its address. Only the main thread may call it. */
#ifndef TRIP_SERVE_H
#define TRIP_SERVE_H

#include "frames.h"

/* Zero means the default. */
typedef struct trip_serve_params {
    const char *input;        /* a data set, or an input of `find` */
    int port;                 /* 0 selects a free port */
    double frames_per_second; /* while the view moves; 0 means 30 */
    uint64_t memory_bytes;    /* as in triptych_resources, like the next three */
    unsigned threads;
    triptych_renderer renderer;
    triptych_engine engine;
    const char *choices_folder; /* as in triptych_resources */
    const char *function;
    const char *heat; /* heat data set; may be NULL */
    draw_settings settings;
    /* Called once with the address to open. */
    void (*ready)(void *user, const char *address);
    void *user;
    /* As in frames.h; NULL means that the input is a data set. */
    int (*find)(void *user, triptych *t, const char *input, bool keep_all, bool *small,
                const char **path);
    int (*open)(void *user, triptych *t, const char *path, const triptych_resources *resources);
    void (*release)(void *user);
    void *find_user;
} trip_serve_params;

/* Runs until the program is interrupted. Returns 0, also after an interruption, or a reported
 * failure. */
int trip_serve_run(const trip_serve_params *params);

#endif
