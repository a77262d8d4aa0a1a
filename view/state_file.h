/* How a data set was last looked at, kept in a file of its own: camera, function, settings. The
 * files lie in $XDG_STATE_HOME/triptych, else in ~/.local/state/triptych, named after the data
 * set's path. They are bytes from outside: what is not a state is refused whole. One thread. */
#ifndef TRIP_VIEW_STATE_FILE_H
#define TRIP_VIEW_STATE_FILE_H

#include "navigation.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_view_state {
    bool has_navigation;
    trip_navigation navigation;
    char *function; /* preset or file; NULL: the data set's own */
    char *text;     /* of a function, in its place; NULL: none */
    char *heat;     /* the data set of its heat, by its whole path; NULL: none */
    double opacity_scale;
    /* Of these what a viewer changes: classification, compositing, slices, method, shading, light,
     * effects, h, kernel radius, background, level of detail, samples, clipping, what is shown. */
    triptych_settings settings;
    bool clips;                       /* settings.clip counts */
    bool panel, box, axes, scale_bar; /* shown */
} trip_view_state;

/* The file for a data set, for free(): 0, or a reported failure. */
int trip_state_file_path(char **path, const char *data);

/* Puts what the file says in the place of what *s holds, and takes ownership of its texts; the
 * others are released. 1: it was there; 0: there is none, or it is of another data set; negative: a
 * reported failure. *s is then as before. */
int trip_state_file_load(trip_view_state *s, const char *data);
/* Replaces the file whole, or leaves it as it is: 0, or a reported failure. */
int trip_state_file_save(const trip_view_state *s, const char *data);
/* The two texts. */
void trip_view_state_release(trip_view_state *s);

/* The text of a file, as these read and write it, for free(); NULL without memory. */
char *trip_view_state_print(const trip_view_state *s, const char *data);
/* 1, 0, negative as above; `path` is for messages. */
int trip_view_state_parse(trip_view_state *s, const char *data, const char *text, const char *path);

#ifdef __cplusplus
}
#endif

#endif
