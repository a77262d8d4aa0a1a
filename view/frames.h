/* The thread that draws. It alone uses the library's context, of the one data set that is shown;
 * the window's thread leaves the view to draw, takes the picture that is there, and waits for
 * neither. What is wanted last counts: a frame under way is finished only where it is quick, so
 * that motion is seen, and given up otherwise. A frame of a view that just came is as small and
 * coarse as it has to be for its time; then the whole picture follows, which is that of `triptych
 * render`, bit for bit. Functions are for one thread, the window's, but for those of
 * trip_frames_params. */
#ifndef TRIP_VIEW_FRAMES_H
#define TRIP_VIEW_FRAMES_H

#include <stdbool.h>
#include <stdint.h>

#include "navigation.h"
#include "triptych.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_frames trip_frames;

typedef struct trip_frames_params {
    uint64_t memory_bytes; /* as triptych_resources; 0: the default */
    unsigned threads;
    triptych_renderer renderer;
    triptych_engine engine;
    double frames_per_second; /* while the view moves; 0: 30 */
    /* By the drawing thread: something has come. */
    void (*wake)(void *user);
    void *wake_user;
    /* The same: the data set to open for what the user named, which stays where it is until
     * release(); one with all values, which was made before, where keep_all. *small says whether it
     * is of samples alone, in the place of a large one that is yet to be made. NULL: names are data
     * sets. A failure is reported in the context or the thread's
     * scope. */
    int (*find)(void *user, triptych *t, const char *input, bool keep_all, bool *small,
                const char **path);
    void (*release)(void *user);
    void *user;
} trip_frames_params;

/* NULL without memory or threads. */
trip_frames *trip_frames_start(const trip_frames_params *params);
/* Gives up what is under way, which takes milliseconds. */
void trip_frames_stop(trip_frames *f);

/* What is to be seen. Texts are copied. */
typedef struct trip_wanted {
    unsigned document; /* another number: another data set, or the same opened anew */
    const char *input;
    bool keep_all;    /* one that has all values: as find() */
    const char *heat; /* the data set of its heat; NULL: it has none */
    /* Where to look from; without it the view is found by `start`, whose pointers stay valid. */
    bool has_navigation;
    trip_navigation navigation;
    const triptych_view *start; /* NULL: the default */
    int width, height;          /* of the picture, px */
    const char *function;       /* preset or file; NULL: the data set's own */
    const char *text;           /* of a function, in its place */
    double opacity_scale;
    triptych_settings settings;
} trip_wanted;

/* From now on this is wanted. */
void trip_frames_want(trip_frames *f, const trip_wanted *wanted);

/* What is known of a data set once it is open; later, where a view that had to be found looks from,
 * and the text of another function. */
typedef struct trip_opened {
    unsigned document;
    bool first;         /* it has just been opened; else only navigation and function are set */
    bool small;         /* as find() says */
    bool cold;          /* the data set of its heat cannot be had: it is shown without */
    triptych_info info; /* without notes */
    triptych_histogram histogram;
    char *function; /* its text; NULL where it is as it was, or has none in data units */
    trip_navigation navigation;
    char *source; /* the path that was opened */
} trip_opened;

/* True when a data set was opened or a view found since; free with trip_opened_free(). */
bool trip_frames_take_opened(trip_frames *f, trip_opened *out);
void trip_opened_free(trip_opened *o);

typedef struct trip_frames_status {
    unsigned document;          /* that this is about */
    bool open;                  /* there is a data set */
    bool exact;                 /* the picture is the one that is wanted, whole */
    bool failed;                /* for the reason `message` */
    bool left_out;              /* the function shows values that were not kept */
    bool unsaved;               /* the last file of trip_frames_save() could not be written */
    bool rests;                 /* nothing more comes: the picture is exact, or has failed */
    char message[512];          /* of the last failure or warning; "" */
    uint64_t messages;          /* how many there were */
    char stage[16];             /* what goes on: "draw", "read", "merge", ...; "": nothing */
    double done;                /* of that, 0 to 1 */
    double scale;               /* of the last frame of a moving view */
    double lod_px;              /* voxels that were so wide in it were drawn by coarse levels */
    double moving_ms;           /* it took */
    double whole_ms;            /* the last whole picture took */
    uint64_t frames;            /* whole or not, since the start */
    uint64_t moving;            /* of those, of a moving view */
    triptych_frame_stats stats; /* of the last whole picture; its texts are copied below */
    char renderer[64], device[128], engine[64], ring[128];
} trip_frames_status;

trip_frames_status trip_frames_get_status(trip_frames *f);

/* How long the last frames of moving views took, in ms, the latest last: so many, up to `most`. */
enum { TRIP_FRAMES_TIMES = 4096 };
int trip_frames_get_times(trip_frames *f, int max, float *ms);
/* The plan of the last whole picture, in words, for free(); NULL: there is none. */
char *trip_frames_explain(trip_frames *f);

/* The last picture, 8 bits a channel, red first, opaque. */
typedef struct trip_picture {
    const uint8_t *rgba;
    int width, height;           /* of its pixels */
    int full_width, full_height; /* of the picture that was wanted */
    trip_navigation navigation;  /* seen from there */
    unsigned document;
    bool whole;      /* as large as wanted, and complete */
    uint64_t number; /* grows with each one */
} trip_picture;

/* Calls `use` with the picture if it is another one than `number` and can be had at once; then
 * true.
 */
bool trip_frames_use_picture(trip_frames *f, uint64_t number,
                             void (*use)(void *user, const trip_picture *p), void *user);

/* Writes the whole picture of what is wanted once it is there, as `triptych render` does; the
 * status's message then names it. */
void trip_frames_save(trip_frames *f, const char *path);
/* Whether one is yet to be written. */
bool trip_frames_saving(trip_frames *f);

/* What is seen at a place of the picture, in its pixels, once the whole picture is there; until
 * then the last answer. */
typedef struct trip_probed {
    bool valid; /* something was looked at, */
    double x, y;
    trip_navigation navigation; /* seen from there */
    triptych_hit hit;
} trip_probed;

void trip_frames_probe(trip_frames *f, double x, double y);
trip_probed trip_frames_get_probed(trip_frames *f);

#ifdef __cplusplus
}
#endif

#endif
