/* The viewer without its window: data sets, what each is shown by, what people's input does to it,
 * and what is wanted of the drawing thread. The window's thread only. */
#ifndef TRIP_VIEW_VIEWER_H
#define TRIP_VIEW_VIEWER_H

#include "camera_path.h"
#include "event.h"
#include "frames.h"
#include "tf_editor.h"
#include "maker.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A data set, and how it is shown. */
typedef struct trip_document {
    unsigned number; /* no two have the same */
    char *input;     /* as the user named it */
    bool keep_all;   /* it is bricked anew, with all values */
    char *heat;      /* the data set of its heat; NULL: none */
    bool cold;       /* which cannot be had: it is shown without */
    bool small;      /* of samples: the whole is to be bricked, or is being */
    bool opened;     /* what follows is known */
    triptych_info info;
    char *source; /* the path of the data set */
    triptych_histogram histogram;
    bool has_navigation; /* else it is being found, by: */
    triptych_view start;
    trip_navigation navigation;
    char *function; /* preset or file; NULL: its own */
    bool edited;    /* the editor's in its place */
    trip_tf_editor *editor;
    uint64_t revision; /* of the editor, that is wanted */
    double opacity_scale;
    triptych_settings settings; /* but for clipping: */
    bool clips;                 /* by settings.clip, which stays as it is while it does not */
    trip_camera_path path;      /* of the views that were marked, */
    char *path_file;            /* in this file; NULL: none was */
} trip_document;

enum { TRIP_DOCUMENTS = 64 };

typedef struct trip_viewer {
    trip_frames *frames;
    trip_maker *maker; /* the caller's; NULL: nothing is bricked again */
    trip_document *documents[TRIP_DOCUMENTS];
    int count, shown;                              /* the one in the window; -1: none */
    unsigned numbers;                              /* given out */
    int width, height;                             /* of the window's contents, px */
    double scale;                                  /* of texts and controls */
    int picture_width;                             /* of its left, which the picture takes */
    bool panel, keys, box, axes, scale_bar, probe; /* shown */
    bool quits;
    double at[2];               /* the pointer's */
    bool buttons[TRIP_BUTTONS]; /* held, and pressed in the picture */
    bool held[TRIP_KEYS];       /* keys */
    unsigned modifiers;
    double probed[2];            /* where the pointer was probed, */
    trip_navigation probed_from; /* seen from there */
    bool changed;                /* something else is to be wanted */
    trip_frames_status status;
    char message[512];      /* the last, */
    double message_seconds; /* ago */
    uint64_t messages;
    /* By the window: */
    void *user;
    void (*copy)(void *user, const char *text); /* into the clipboard */
    bool fresh; /* how a data set was last looked at is neither read nor kept */
    /* What documents begin with; what was given of it goes before what was kept of them. */
    bool start_given, settings_given;
    triptych_view start;
    triptych_settings settings;
    const char *function, *heat;
    double opacity_scale; /* 0: not given */
} trip_viewer;

/* Frames stay the caller's. */
void trip_viewer_init(trip_viewer *v, trip_frames *frames);
/* Also keeps how the data sets were looked at. */
void trip_viewer_release(trip_viewer *v);

/* NULL where none is shown. */
trip_document *trip_viewer_document(trip_viewer *v);
/* What the library is to be set to: without what cannot be shown of it. */
triptych_settings trip_viewer_settings(const trip_document *d);
/* The data set of its heat that can be had; NULL: there is none. */
const char *trip_viewer_heat(const trip_document *d);
/* Opens a data set or volume beside the others, and shows it; one that is open already is opened
 * anew. */
void trip_viewer_open(trip_viewer *v, const char *input);
void trip_viewer_close(trip_viewer *v);
void trip_viewer_show(trip_viewer *v, int which);

void trip_viewer_resize(trip_viewer *v, int width, int height);
/* Not those of scripts alone. The panel's own input is not given. */
void trip_viewer_event(trip_viewer *v, const trip_event *e);
/* Lets go of what is held, as where the panel takes the input. */
void trip_viewer_let_go(trip_viewer *v);

/* Takes what the drawing thread has, moves what flies, and says what is wanted. Returns whether
 * something goes on by itself. */
bool trip_viewer_tick(trip_viewer *v, double seconds);
/* Whether the picture of what is wanted is there and whole, or will not come; and nothing is being
 * bricked again. */
bool trip_viewer_rests(trip_viewer *v);

/* ---- what keys and the panel do ---- */

void trip_viewer_say(trip_viewer *v, const char *text);
void trip_viewer_set_panel(trip_viewer *v, bool shown);
/* The view from there, found by the library. */
void trip_viewer_see_side(trip_viewer *v, triptych_side side);
void trip_viewer_fit(trip_viewer *v);
/* Writes the whole picture into the folder it was started in, under a name of its own. */
void trip_viewer_take_picture(trip_viewer *v);
void trip_viewer_copy_options(trip_viewer *v);
/* The present view and function become the next key of a path of the camera, for
 * `triptych render --path`, which is written into a file of its own in the same folder. */
void trip_viewer_mark(trip_viewer *v);
/* A preset or file; NULL: the data set's own. */
void trip_viewer_set_function(trip_viewer *v, const char *function);
/* Bricks the data set's volume again, with all values, while it is shown as it is. */
void trip_viewer_brick_again(trip_viewer *v);
/* What is shown as options of `triptych render`, all but an edited function; for free(), NULL:
 * there is none. */
char *trip_viewer_options(trip_viewer *v);

/* Where a picture of another view lies in the window, in clip coordinates, as trip_blit_draw()
 * takes them: as a plane through the point that was looked at. */
void trip_viewer_corners(const trip_viewer *v, const trip_picture *p, float corners[4][4]);
/* Whether the picture shows the view that is wanted, at its size. */
bool trip_viewer_is_current(const trip_viewer *v, const trip_picture *p);

#ifdef __cplusplus
}
#endif

#endif
