/* The viewer: shows data sets in a window until the user closes it. Only the main thread may call
 * it. */
#ifndef TRIP_VIEW_VIEW_H
#define TRIP_VIEW_VIEW_H

#include "frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Zero means the default. */
typedef struct trip_view_params {
    const char *const *inputs; /* data sets, or inputs of `find` */
    int count;
    int width, height; /* of the window, in screen coordinates; default 1100 x 720 */
    double scale;      /* of texts and controls; default from the screen */
    double frames_per_second;
    uint64_t memory_bytes; /* as in triptych_resources, like the next three */
    unsigned threads;
    triptych_renderer renderer;
    triptych_engine engine;
    const char *choices_folder; /* as in triptych_resources */
    triptych_view start;        /* first view of each data set; its pointers stay valid */
    const char *function;
    const char *heat; /* heat data set of the inputs; may be NULL */
    double opacity_scale;
    draw_settings settings;
    bool start_given, settings_given; /* override the saved state of a data set */
    bool no_panel;
    bool fresh;         /* neither restores nor saves states */
    const char *script; /* file of events; the viewer ends after the last */
    void *user;
    /* As in frames.h and maker.h. */
    int (*find)(void *user, triptych *t, const char *input, bool keep_all, bool *small,
                const char **path);
    int (*open)(void *user, triptych *t, const char *path, const triptych_resources *resources);
    int (*make)(void *user, triptych *t, const char *input,
                bool keep_all); /* NULL disables background bricking */
    void (*release)(void *user);
    /* Checks each file that the script writes, before the window opens. Returns 0, or a reported
     * failure. NULL allows any file. */
    int (*check_output)(void *user, const char *path);
    void *check_user;
} trip_view_params;

/* Runs until the window is closed. Returns 0, or a reported failure. */
int trip_view_run(const trip_view_params *params);

#ifdef __cplusplus
}
#endif

#endif
