/* The state of the served viewer. Any thread may send events and wait for pictures. */
#ifndef TRIP_SERVE_SESSION_H
#define TRIP_SERVE_SESSION_H

#include <stddef.h>

#include "serve.h"

typedef struct trip_session trip_session;

/* Returns NULL if memory or threads are exhausted. */
trip_session *trip_session_start(const trip_serve_params *params);
/* Requires that no other thread uses the session. */
void trip_session_stop(trip_session *s);
/* Wakes all waiting threads, and makes later waits return at once. */
void trip_session_end(trip_session *s);

/* Advances the viewer, then waits for news or for about the timeout. */
void trip_session_tick(trip_session *s, double seconds);

/* Handles pointer, key and resize events, as lines of a viewer script (script.h). Returns false,
 * and does nothing, if any line is invalid or of another kind. */
bool trip_session_do(trip_session *s, const char *text, size_t bytes);
/* Sets a built-in transfer function or the command line's; "" selects the data set's default.
 * Returns false for unknown names, and for a scene. */
bool trip_session_set_function(trip_session *s, const char *name);

/* Sets a setting by its name on the page: opacity, light, an effect's name in light.h, or the name
 * of an option. A light is "head", "turns", "fixed", "AZIMUTH,ELEVATION" or
 * "AZIMUTH,ELEVATION,DISTANCE" of light.h. Returns false, and changes nothing, for an unknown name,
 * an invalid value, or a setting that does not apply to the data. */
bool trip_session_set(trip_session *s, const char *name, const char *value);
/* Returns the names of the built-in transfer functions as JSON, for free(), or NULL if memory is
 * exhausted. */
char *trip_session_presets(void);

/* A picture as an encoded file, for free(). */
typedef struct trip_session_picture {
    unsigned char *file;
    size_t bytes;
    uint64_t number;
    bool whole; /* the full picture of `triptych render`, as PNG; otherwise a JPEG */
} trip_session_picture;
/* Waits for a picture other than `number`. Returns false at the timeout. */
bool trip_session_await(trip_session *s, uint64_t number, double seconds,
                        trip_session_picture *out);

/* Takes the failure since the last call, as a line without its newline. Returns false if there is
 * none. */
bool trip_session_take_failure(trip_session *s, char *line, size_t bytes);

/* Returns the status as JSON, for free(), or NULL if memory is exhausted. */
char *trip_session_status(trip_session *s);

#endif
