/* The viewer: a window that shows data sets until the user closes it. Main thread only. */
#ifndef TRIP_VIEW_VIEW_H
#define TRIP_VIEW_VIEW_H

#include "frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Zero means the default. */
typedef struct trip_view_params {
    const char *const *inputs; /* data sets, or what `find` makes one of */
    int count;
    int width, height; /* of the window, in its own units; 1100 x 720 */
    double scale;      /* of texts and controls; the screen's */
    double frames_per_second;
    uint64_t memory_bytes; /* these as triptych_resources */
    unsigned threads;
    triptych_renderer renderer;
    triptych_engine engine;
    triptych_view start; /* where documents are seen from; what it points to stays valid */
    const char *function;
    const char *heat; /* the data set of the heat of the inputs; NULL: none */
    double opacity_scale;
    triptych_settings settings;
    bool start_given, settings_given; /* else what was kept of the data set goes before */
    bool no_panel;
    bool fresh;         /* nothing is kept of how data sets were looked at */
    const char *script; /* a file of events, after which it ends */
    void *user;
    /* As frames.h and maker.h have them. */
    int (*find)(void *user, triptych *t, const char *input, bool keep_all, bool *small,
                const char **path);
    int (*make)(void *user, triptych *t, const char *input,
                bool keep_all); /* NULL: nothing is made */
    void (*release)(void *user);
    /* Of each file that the script writes, before anything is shown: 0, or a reported failure.
     * NULL: any may be written. */
    int (*check_output)(void *user, const char *path);
    void *check_user;
} trip_view_params;

/* Until the window is closed: 0, or a reported failure. */
int trip_view_run(const trip_view_params *params);

#ifdef __cplusplus
}
#endif

#endif
