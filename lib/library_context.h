/* What is behind a triptych handle, for the library's own files. One thread at a time, but for
 * trip_scope_cancel(). */
#ifndef TRIP_CONTEXT_H
#define TRIP_CONTEXT_H

#include <pthread.h>
#include <stdio.h>

#include "emission.h"
#include "frame.h"
#include "field.h"
#include "image_file.h"
#include "light_map.h"
#include "lod_parts.h"
#include "renderer_choice.h"
#include "library_session.h"
#include "sheet_samples.h"
#include "triptych.h"

enum { TRIP_CONTEXT_MAX_THREADS = 256 };

/* A picture's memory, of the budget. */
typedef struct trip_context_picture {
    struct trip_context_picture *next;
    float *pixels;
    size_t bytes;
} trip_context_picture;

struct triptych {
    trip_scope scope;
    pthread_mutex_t lock;
    char error[4096]; /* under lock */
    void (*take)(void *user, const char *line);
    void *take_user;
    void (*show)(void *user, const char *stage, uint64_t done, uint64_t total);
    void *show_user;

    triptych_resources resources;
    char *name;
    session session;
    bool open, has_function;
    trip_context_picture *pictures;
    trip_field *source;      /* of a volume's own values; NULL: the data set's */
    trip_renderer *renderer; /* NULL until a frame is begun */
    trip_reader *reader;     /* the same; of these planes: */
    unsigned planes;
    trip_dataset *at_level; /* what a part is drawn from that has a coarse level; else NULL */
    unsigned level;         /* that */
    trip_lod_parts parts;   /* of the frame that is begun */
    int part;               /* of these the one that is drawn, */
    float *before;          /* and the picture of those before it, of the budget; else NULL */
    size_t before_bytes;    /* what that takes; it may be kept for the next frame */
    triptych_frame_stats before_stats; /* theirs */
    trip_settings settings;            /* slices 0: by the view */
    triptych_clip clip;                /* as given; frames have it in drawn_settings */
    double max_ms;                     /* 0: no bound of time */
    double bytes_per_ms;               /* that bounded frames took; 0: none was drawn */
    bool kernel_warned;                /* that the halo is short for it */
    bool levels_warned;                /* that there are none for the classification */
    bool classify_auto;                /* settings.classify is what that has come to for a frame */
    double kelvin[2];                  /* of emission, as set */
    int effects;                       /* as set; frames have what they come to in drawn_settings */
    const char *why_effects; /* of those that auto chose or left; NULL: nothing was left to it */
    trip_light_map *light;   /* of frames with shadows or occlusion; NULL: none was drawn of late */
    trip_emission *heat;     /* NULL: none is given */
    bool normalise;          /* colours by opacity, as set */
    bool
        counting; /* frames count exactly, and draw what is occluded too; the reader is for that: */
    bool reader_counts;

    bool has_view;
    trip_camera_params view, turned;
    trip_vec3 axis;      /* that a turn goes about */
    uint64_t fit_splats; /* looked at to fit the view */

    trip_settings drawn_settings; /* of the frame that is begun, with what was chosen */
    const char *why_pre;          /* where pre was; else NULL */
    trip_view_samples_per_sheet samples_per_sheet; /* that the view calls for */
    bool begun, drawn; /* the camera and the plan are there; the drawing, too */
    trip_camera camera;
    trip_plan plan;
    double plan_ms;
    trip_frame frame;
    trip_drawing drawing;

    bool rounding_checked; /* of the function and the settings that are set */
    bool has_stats;
    triptych_frame_stats stats;
    char device[128]; /* whose text that has: the renderer may go before the data set */
    triptych_list_stats *list_stats; /* by the data set's lists, of the budget; NULL: not yet */

    trip_image_files files;
};

/* Every call works in the context's scope: trip_context_leave() with what enter returned, which
 * gives back `status`. */
trip_scope *trip_context_enter(triptych *t);
/* The same for a call that is not about a frame that is begun: what was cancelled before is
 * forgotten. */
trip_scope *trip_context_enter_anew(triptych *t);
int trip_context_leave(trip_scope *before, int status);

/* Fails while a frame is begun, or without the data set that is needed. */
int trip_context_check_idle(const triptych *t, bool needs_data);
int trip_context_check_open(const triptych *t);
/* Fails where the data set has no such list, or none is open. */
int trip_context_check_list(const triptych *t, unsigned number);

/* As the public functions, in the context's scope and with checked parameters. */
int trip_context_use_transfer_function(triptych *t, const triptych_transfer_function *f);
int trip_context_find_view(triptych *t, const triptych_view *given);
void trip_context_drop_reader(triptych *t);
/* Frames are drawn from the data set itself again. */
void trip_context_drop_level(triptych *t);
/* What is cut away, in world space. */
trip_clip trip_context_clip(const triptych *t);
/* And the reader, which may be in its memory. */
void trip_context_drop_renderer(triptych *t);
/* The effects of a frame that is planned: sets them in drawn_settings. */
int trip_context_choose_effects(triptych *t);
/* Begins what light reaches, and heat, for the frame that is planned; drops them where nothing
 * depends on them. */
int trip_context_begin_light(triptych *t);
void trip_context_drop_light(triptych *t);
void trip_context_drop_heat(triptych *t);
/* An effect a line: whether it runs and why. */
void trip_context_explain_effects(const triptych *t, FILE *out);
/* What the frame has come to, once its picture is complete. */
int trip_context_note_stats(triptych *t);
void trip_context_drop_stats(triptych *t);

/* Passes on how far bricking's stage is; `user` is the context, which shows progress. */
void trip_context_show_stage(void *user, const char *stage, uint64_t done, uint64_t total);

/* So many threads as a renderer or reader takes. */
static inline unsigned trip_context_threads(unsigned wanted)
{
    return wanted < TRIP_CONTEXT_MAX_THREADS ? wanted : TRIP_CONTEXT_MAX_THREADS;
}

#endif
