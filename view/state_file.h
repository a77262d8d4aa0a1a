/* Saves and restores the last view of each data set: camera, transfer function, settings. Each data
 * set has a file in $XDG_STATE_HOME/triptych or ~/.local/state/triptych, named after its path. The
 * parser refuses the entire file if any part is invalid. One thread at a time. */
#ifndef TRIP_VIEW_STATE_FILE_H
#define TRIP_VIEW_STATE_FILE_H

#include "draw_settings.h"
#include "navigation.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_view_state {
    bool has_navigation;
    trip_navigation navigation;
    char *function; /* preset or file; NULL means the data set's default */
    char *text;     /* a transfer function as text, in place of `function`; may be NULL */
    char *heat;     /* absolute path of the heat data set; may be NULL */
    double opacity_scale;
    /* Only the settings that the viewer changes are saved. */
    draw_settings settings;
    bool clips;                       /* settings.clip is active */
    bool panel, box, axes, scale_bar; /* visible */
} trip_view_state;

/* Sets *path to the file of a data set, for free(). Returns 0, or a reported failure. */
int trip_state_file_path(char **path, const char *data);

/* Replaces *s by the state in the file, and releases the old texts. Returns 1 on success, 0 if
 * there is no file for this data set, or a reported failure. *s changes only on success. */
int trip_state_file_load(trip_view_state *s, const char *data);
/* Replaces the file. Returns 0, or a reported failure that leaves the old file. */
int trip_state_file_save(const trip_view_state *s, const char *data);
/* Frees the texts. */
void trip_view_state_release(trip_view_state *s);

/* Returns the contents of a state file, for free(), or NULL if memory is exhausted. */
char *trip_view_state_print(const trip_view_state *s, const char *data);
/* Parses the contents of a state file, with the results of trip_state_file_load(). `path` appears
 * in messages. */
int trip_view_state_parse(trip_view_state *s, const char *data, const char *text, const char *path);

#ifdef __cplusplus
}
#endif

#endif
