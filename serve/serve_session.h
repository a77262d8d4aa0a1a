/* What is shown, for any number of threads: events change it, pictures are waited for. */
#ifndef TRIP_SERVE_SESSION_H
#define TRIP_SERVE_SESSION_H

#include <stddef.h>

#include "serve.h"

typedef struct trip_session trip_session;

/* NULL without memory or threads. */
trip_session *trip_session_start(const trip_serve_params *params);
/* No thread may be in the others any more. */
void trip_session_stop(trip_session *s);
/* Threads that wait are let go, and none waits from now on. */
void trip_session_end(trip_session *s);

/* What goes on by itself, until about so long has passed or something has come. */
void trip_session_tick(trip_session *s, double seconds);

/* Events as lines of a script of the viewer (script.h): of the pointer, keys, and sizes. False
 * where some are none of these, or none at all; nothing happens then. */
bool trip_session_do(trip_session *s, const char *text, size_t bytes);
/* A built-in function, or that of the command line; false where there is none of the name. "": the
 * data set's own. */
bool trip_session_set_function(trip_session *s, const char *name);

/* A setting by its name, as the page has them: classify, method, h, shading, light (head, or
 * "ROUND,UP,DISTANCE" of trip_light_control), opacity, show, and those of effects by their names in
 * light.h. False where there is no such name or value; nothing happens
 * then. */
bool trip_session_set(trip_session *s, const char *name, const char *value);
/* The built-in functions' names as JSON, for free(); NULL without memory. */
char *trip_session_presets(void);

/* A picture as a file, for free(). */
typedef struct trip_session_picture {
    unsigned char *file;
    size_t bytes;
    uint64_t number;
    bool whole; /* PNG, the picture of `triptych render`; else JPEG */
} trip_session_picture;
/* Waits for a picture other than `number`, at most so long; false: there is none. */
bool trip_session_await(trip_session *s, uint64_t number, double seconds,
                        trip_session_picture *out);

/* What failed since the last call, as a line without its end; false: nothing did. */
bool trip_session_take_failure(trip_session *s, char *line, size_t bytes);

/* What goes on, as JSON, for free(); NULL without memory. */
char *trip_session_status(trip_session *s);

#endif
