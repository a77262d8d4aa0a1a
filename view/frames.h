/* The drawing thread. Only this thread uses the library's context, which holds the data set in the
 * window. The window's thread posts the wanted view and takes the latest picture; it never waits.
 * The latest view replaces earlier ones. A frame in progress is finished if it is quick, and
 * abandoned otherwise. For a new view it first draws a frame as small and coarse as the frame time
 * needs. The full picture follows, with the same bits as `triptych render`'s. If the choice of its
 * quality is not known, it is first drawn with the defaults, and the trial comes after it. The
 * window's thread calls these functions; the callbacks of trip_frames_params run on the drawing
 * thread. */
#ifndef TRIP_VIEW_FRAMES_H
#define TRIP_VIEW_FRAMES_H

#include <stdbool.h>
#include <stdint.h>

#include "navigation.h"
#include "draw_settings.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_frames trip_frames;

typedef struct trip_frames_params {
    uint64_t memory_bytes; /* as in triptych_resources; 0 means the default */
    unsigned threads;
    triptych_renderer renderer;
    triptych_engine engine;
    double frames_per_second;   /* while the view moves; 0 means 30 */
    const char *choices_folder; /* as in triptych_resources; stays valid */
    /* Called by the drawing thread when there is something new to show. */
    void (*wake)(void *user);
    void *wake_user;
    /* Called by the drawing thread. Sets *path to the data set for the user's `input`; it stays in
     * place until release(). With keep_all it must hold all values and exist already. *small is set
     * if the data set is only a preview from samples. NULL means that inputs are data sets.
     * Failures are reported in the context or the thread's scope. */
    int (*find)(void *user, triptych *t, const char *input, bool keep_all, bool *small,
                const char **path);
    void (*release)(void *user);
    void *user;
} trip_frames_params;

/* Starts the thread. Returns NULL if memory or threads are exhausted. */
trip_frames *trip_frames_start(const trip_frames_params *params);
/* Abandons the frame in progress and ends the thread, within milliseconds. */
void trip_frames_stop(trip_frames *f);

/* The wanted view of a data set. Texts are copied. */
typedef struct trip_wanted {
    unsigned document; /* a new number opens the data set (again) */
    const char *input;
    bool keep_all;    /* as for find() */
    const char *heat; /* data set with the heat for emission; may be NULL */
    /* The view. If has_navigation is false, the library finds it from `start`. */
    bool has_navigation;
    trip_navigation navigation;
    const triptych_view *start; /* NULL means the default; its pointers stay valid */
    int width, height;          /* of the picture, px */
    const char *function;       /* preset or file; NULL means the data set's default */
    const char *text;           /* a transfer function as text, in place of `function` */
    double opacity_scale;
    draw_settings settings; /* the parts that do not apply to the data are left out */
} trip_wanted;

/* Replaces the wanted view. */
void trip_frames_want(trip_frames *f, const trip_wanted *wanted);

/* News of a data set: its description once it is open, and later each view that the library found
 * and each new transfer function as text. */
typedef struct trip_opened {
    unsigned document;
    bool first;           /* just opened; otherwise only navigation and function are set */
    bool small;           /* as find() set it */
    bool cold;            /* the heat data set failed to open; drawn without emission */
    bool is_scene;        /* a Gaussian scene: `info` has only the bounds that views fit */
    triptych_info info;   /* notes is NULL */
    triptych_scene scene; /* notes is NULL; zero for a volume */
    triptych_histogram histogram;
    char *function; /* as text in data units; NULL if unchanged or without such a text */
    trip_navigation navigation;
    char *source; /* path of the open data set */
} trip_opened;

/* Takes the news since the last call. Returns false if there are none. Free with
 * trip_opened_free(). */
bool trip_frames_take_opened(trip_frames *f, trip_opened *out);
void trip_opened_free(trip_opened *o);

typedef struct trip_frames_status {
    unsigned document;          /* the data set that this describes */
    bool open;                  /* a data set is open */
    bool exact;                 /* the picture is complete and of the wanted view */
    bool failed;                /* `message` gives the reason */
    bool left_out;              /* the transfer function reveals voxels that bricking dropped */
    bool unsaved;               /* the last trip_frames_save() failed */
    bool rests;                 /* idle: the picture is exact, or drawing failed */
    char message[512];          /* the last failure or warning, or "" */
    uint64_t messages;          /* failures and warnings so far */
    char stage[16];             /* "draw", "read", "merge", ...; "" if idle */
    double done;                /* share of the stage, 0 to 1 */
    double scale;               /* resolution of the last moving frame, up to 1 */
    double lod_px;              /* its level of detail, as triptych_lod_settings.voxel_px */
    double moving_ms;           /* its time */
    double whole_ms;            /* time of the last full picture */
    uint64_t frames;            /* drawn since the start */
    uint64_t moving;            /* moving frames since the start */
    triptych_frame_stats stats; /* of the last full picture; texts are copied below */
    char renderer[64], device[128], engine[64], ring[128];
} trip_frames_status;

trip_frames_status trip_frames_get_status(trip_frames *f);

/* Copies the times of the last moving frames, at most `max`, in ms, the latest last. Returns the
 * count. */
enum { TRIP_FRAMES_TIMES = 4096 };
int trip_frames_get_times(trip_frames *f, int max, float *ms);
/* Returns the plan of the last full picture as text, for free(), or NULL if there is none. */
char *trip_frames_explain(trip_frames *f);

/* A picture: red, green, blue, alpha 255, 8 bits per channel. */
typedef struct trip_picture {
    const uint8_t *rgba;
    int width, height;           /* of `rgba`, px */
    int full_width, full_height; /* of the full picture, px */
    trip_navigation navigation;  /* the view drawn */
    unsigned document;
    bool whole;      /* full size and complete */
    uint64_t number; /* ascends with each picture */
} trip_picture;

/* Calls `use` with the latest picture and returns true, if its number differs from `number` and the
 * drawing thread is not writing it. */
bool trip_frames_use_picture(trip_frames *f, uint64_t number,
                             void (*use)(void *user, const trip_picture *p), void *user);

/* Writes the full picture of the wanted view when it is complete, as `triptych render` does. The
 * status's message then names the file. */
void trip_frames_save(trip_frames *f, const char *path);
/* Returns whether a picture is still to be written. */
bool trip_frames_saving(trip_frames *f);

/* The answer of the last probe. */
typedef struct trip_probed {
    bool valid; /* a probe was answered */
    double x, y;
    trip_navigation navigation; /* the view probed */
    triptych_hit hit;
} trip_probed;

/* Asks for the visible value at a position in pixels. The answer comes once the full picture is
 * complete. */
void trip_frames_probe(trip_frames *f, double x, double y);
trip_probed trip_frames_get_probed(trip_frames *f);

#ifdef __cplusplus
}
#endif

#endif
