/* The viewer without its window: the data sets, how each is drawn, the effect of input, and the
 * wishes to the drawing thread. Only the window's thread uses it. */
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

/* A data set and how it is drawn. */
typedef struct trip_document {
    unsigned number;      /* unique */
    char *input;          /* the user's name for it */
    bool keep_all;        /* bricked again, with all voxels */
    char *heat;           /* heat data set; may be NULL */
    bool cold;            /* heat failed to open; drawn without emission */
    bool small;           /* a preview of samples; the full volume is still to be bricked */
    bool opened;          /* the members below are known */
    draw_kind kind;       /* DRAW_KIND_VOLUME is 0 */
    triptych_info info;   /* unless it is a volume: only the bounds that views fit */
    triptych_scene scene; /* zero for a volume */
    char *source;         /* path of the data set */
    triptych_histogram histogram;
    bool has_navigation; /* false while the library finds it from `start` */
    triptych_view start;
    trip_navigation navigation;
    char *function; /* preset or file; NULL means the data set's default */
    bool edited;    /* the editor's transfer function replaces it */
    trip_tf_editor *editor;
    uint64_t revision; /* of the editor, as last wanted */
    double opacity_scale;
    draw_settings settings;
    bool clips;            /* settings.clip is active */
    trip_camera_path path; /* of the marked views */
    char *path_file;       /* file of the path; NULL until a view is marked */
} trip_document;

enum { TRIP_DOCUMENTS = 64 };

typedef struct trip_viewer {
    trip_frames *frames;
    trip_maker *maker; /* owned by the caller; NULL disables bricking again */
    trip_document *documents[TRIP_DOCUMENTS];
    int count, shown;                              /* document in the window; -1 if none */
    unsigned numbers;                              /* document numbers used so far */
    int width, height;                             /* of the window's contents, px */
    double scale;                                  /* of texts and controls */
    int picture_width;                             /* width of the picture, left of the panel, px */
    bool panel, keys, box, axes, scale_bar, probe; /* visible */
    bool quits;
    double at[2];               /* pointer position, px */
    bool buttons[TRIP_BUTTONS]; /* held since a press in the picture */
    bool held[TRIP_KEYS];       /* keys held */
    bool tapped[TRIP_KEYS];     /* keys pressed since the last tick, held or not */
    unsigned modifiers;
    double probed[2];            /* position of the last probe, px */
    trip_navigation probed_from; /* view of the last probe */
    bool changed;                /* the wish must be posted again */
    trip_frames_status status;
    char message[512];      /* the last message */
    double message_seconds; /* its age */
    uint64_t messages;
    /* Set by the window: */
    void *user;
    void (*copy)(void *user, const char *text); /* to the clipboard */
    bool fresh;                                 /* neither restores nor saves states */
    /* Initial state of documents; given parts override the saved state. */
    bool start_given, settings_given;
    triptych_view start;
    draw_settings settings;
    const char *function, *heat;
    double opacity_scale; /* 0 if not given */
} trip_viewer;

/* The caller keeps ownership of `frames`. */
void trip_viewer_init(trip_viewer *v, trip_frames *frames);
/* Also saves the states of the data sets. */
void trip_viewer_release(trip_viewer *v);

/* Returns the document in the window, or NULL. */
trip_document *trip_viewer_document(trip_viewer *v);
/* Returns the settings for the library, without the parts that the data set cannot draw. */
draw_settings trip_viewer_settings(const trip_document *d);
/* Returns the transfer function, a preset or a file; NULL for the data set's default and for
 * Gaussian scenes.
 */
const char *trip_viewer_function(const trip_document *d);
/* Returns the heat data set if it can be opened, else NULL. */
const char *trip_viewer_heat(const trip_document *d);
/* Opens a data set or volume and shows it. Opens it again if it is open already. */
void trip_viewer_open(trip_viewer *v, const char *input);
void trip_viewer_close(trip_viewer *v);
void trip_viewer_show(trip_viewer *v, int which);

void trip_viewer_resize(trip_viewer *v, int width, int height);
/* Handles an event of the kinds that people make, unless the panel took it. */
void trip_viewer_event(trip_viewer *v, const trip_event *e);
/* Releases all held keys and buttons, for instance when the panel takes the input. */
void trip_viewer_let_go(trip_viewer *v);

/* Takes news from the drawing thread, advances a flight, and posts the wish. Returns whether
 * something still moves by itself. */
bool trip_viewer_tick(trip_viewer *v, double seconds);
/* Returns whether the viewer is idle: the picture is complete or has failed, and no volume is being
 * bricked. */
bool trip_viewer_rests(trip_viewer *v);

/* ---- actions of keys and panel ---- */

void trip_viewer_say(trip_viewer *v, const char *text);
void trip_viewer_set_panel(trip_viewer *v, bool shown);
/* Changes to the library's view of a side. */
void trip_viewer_see_side(trip_viewer *v, triptych_side side);
void trip_viewer_fit(trip_viewer *v);
/* Writes the full picture into the working folder, under a new name. */
void trip_viewer_take_picture(trip_viewer *v);
void trip_viewer_copy_options(trip_viewer *v);
/* Appends the view and the transfer function as a key of a camera path for `triptych render
 * --path`. Writes the path into a file in the working folder. */
void trip_viewer_mark(trip_viewer *v);
/* Sets a preset or file; NULL selects the data set's default. */
void trip_viewer_set_function(trip_viewer *v, const char *function);
/* Bricks the volume again with all voxels, in the background. */
void trip_viewer_brick_again(trip_viewer *v);
/* Returns the view and settings as options of `triptych render`, except an edited transfer
 * function. For free(); NULL if no document is shown. */
char *trip_viewer_options(trip_viewer *v);

/* Computes the corners for trip_blit_draw() at which a picture of another view appears. The picture
 * is placed on a plane through the point looked at. */
void trip_viewer_corners(const trip_viewer *v, const trip_picture *p, float corners[4][4]);
/* Returns whether the picture has the wanted view and size. */
bool trip_viewer_is_current(const trip_viewer *v, const trip_picture *p);

#ifdef __cplusplus
}
#endif

#endif
