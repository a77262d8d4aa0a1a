/* The structure behind a triptych handle, for the library's own files. One thread at a time may use
 * a context, except for trip_scope_cancel(). */
#ifndef TRIP_CONTEXT_H
#define TRIP_CONTEXT_H

#include <pthread.h>
#include <stdio.h>

#include "draw_settings.h"
#include "emission.h"
#include "frame.h"
#include "framing.h"
#include "field.h"
#include "image_file.h"
#include "light_map.h"
#include "openness.h"
#include "lod_parts.h"
#include "renderer_choice.h"
#include "library_session.h"
#include "quality_choice.h"
#include "sheet_samples.h"
#include "source.h"
#include "surfel_plan.h"
#include "triptych.h"

enum { TRIP_CONTEXT_MAX_THREADS = 256, TRIP_CONTEXT_NOTES = 8 };

/* Default temperature of the greatest heat. */
#define TRIP_HOTTEST_KELVIN 2500.0

/* Memory of a picture, taken from the budget. */
typedef struct trip_context_picture {
    struct trip_context_picture *next;
    float *pixels;
    size_t bytes;
} trip_context_picture;

struct triptych {
    trip_scope scope;
    pthread_mutex_t lock;
    char error[4096];                   /* guarded by lock */
    uint64_t noted[TRIP_CONTEXT_NOTES]; /* hashes of notes, newest last; guarded by lock */
    triptych_message_callback take;
    void *take_user;
    triptych_progress_callback show;
    void *show_user;

    triptych_resources resources;
    char *name;
    session session;                 /* of a scene: the budget and the name alone */
    struct trip_gaussian_set *scene; /* the first one; NULL: the data set is a volume */
    struct trip_placed_set *placed;  /* all scenes of the picture */
    unsigned placed_count;
    uint64_t *placed_drawn; /* Gaussians of each, in the begun frame */
    /* For the occlusion of clouds, one for each of `placed`; equal sets share one. They are kept
     * from frame to frame. NULL: the last frame had no occlusion. */
    trip_openness **openness;
    trip_openness_view *openness_views;
    bool openness_kept;                      /* from an earlier frame, complete */
    struct trip_mixed *mixed;                /* volumes beside scenes; NULL: none */
    struct trip_gaussian_frame *scene_frame; /* the begun frame of a scene */
    trip_renderer *device_renderer;          /* composites the scene (gl); NULL: `renderer` does */
    bool scene_done;                         /* scene_frame is complete */
    bool lit;                                /* light shades the surfels of the frame */
    /* For eye-dome lighting: a number for each pixel of the frame, from the budget. NULL: off. */
    float *levels;
    size_t levels_bytes;
    double scene_opacity;               /* factor of the optical depth; 0 means 1 */
    double begun_ms;                    /* when scene_frame was begun */
    trip_surfel_history surfel_history; /* of the last deferred picture */
    bool open, has_function;
    trip_context_picture *pictures;
    trip_field *source;      /* values of the volume itself; NULL: the data set's values */
    trip_renderer *renderer; /* NULL until a frame begins */
    /* The kind of `renderer`: as in `resources`, unless the settings require another. */
    triptych_renderer required;
    /* Reads `planes`. NULL until a frame begins. */
    trip_reader *reader;
    unsigned planes;
    /* The coarse level that the current part is drawn from; NULL for level 0. */
    trip_dataset *at_level;
    unsigned level;       /* of at_level, otherwise 0 */
    trip_lod_parts parts; /* of the begun frame */
    int part;             /* index of the part that is drawn */
    /* Pictures of the parts before `part`, and one of several rays per pixel. They are taken from
     * the budget. NULL if there are none. */
    float *before;
    /* Size of `before`, which may be kept for the next frame. */
    size_t before_bytes;
    triptych_frame_stats before_stats; /* of the parts and bands before */
    /* Bands of rows, drawn one after the other if the frame does not fit in memory at once. */
    int band, bands, band_rows; /* rows of pixels of the frame; a multiple of the rays */
    float *banded;              /* the picture of the bands before, from the budget; or NULL */
    size_t banded_bytes;
    draw_settings given;    /* as set */
    trip_settings settings; /* of `given`; samples_per_sheet is 0 if the view selects */
    double bytes_per_ms;    /* measured in bounded frames; 0 if none was drawn */
    bool kernel_warned;     /* warned about the halo for the kernel */
    bool levels_warned;     /* warned about missing levels for the classification */
    bool light_noted;       /* noted the light that was chosen for shadows */
    double kelvin[2];       /* of emission */
    /* Reason for the choice of TRIPTYCH_EFFECT_AUTO; NULL without it. */
    const char *why_effects;
    /* For shadows and occlusion. NULL if the last frames had neither. */
    trip_light_map *light;
    trip_emission *heat; /* NULL if no data set of heat is open */
    bool reader_counts;  /* `reader` was made for exact counts */

    trip_choices choices;     /* of earlier frames */
    uint64_t choices_read;    /* checksum of a data set: its stored choices were read; or 0 */
    char *choices_folder;     /* keeps choices; NULL: none */
    trip_choice choice;       /* of the begun frame */
    const trip_choice *fixed; /* in the context of a trial: the choice; otherwise NULL */
    int choice_step;          /* of the begun frame (quality_choice.h) */
    double promise;           /* of the begun frame, of 255; 0: none is made */
    bool choice_waits;        /* the begun frame has the defaults until triptych_choose() */
    unsigned trials;          /* made by this context */
    double trial_ms;          /* time of the trial for the begun frame; 0 without one */
    char no_trial[512];       /* why the trial failed; empty if it did not */

    trip_clip cut; /* further half-spaces in world space, beside the clip of the settings */
    int slab_cuts; /* the last ones of `cut` bound a slab, and take no matter from the light */
    bool has_view;
    trip_camera_params view, turned;
    trip_vec3 axis;      /* axis of triptych_turn() */
    uint64_t fit_splats; /* splats examined to fit the view */

    trip_settings drawn_settings; /* of the begun frame, with all choices made */
    const char *why_pre;          /* reason if auto chose pre, otherwise NULL */
    bool nearest_chosen;          /* for labels, because no interpolation was given */
    bool nearest_noted;           /* a note named the choice */
    char why_splats[64];
    trip_view_samples_per_sheet samples_per_sheet; /* for the view */
    /* `begun`: camera and plan exist. `drawn`: the drawing exists, too. */
    bool begun, drawn;
    trip_camera camera;
    trip_plan plan;
    double plan_ms;
    trip_frame frame;
    trip_drawing drawing;

    bool rounding_checked; /* for the current transfer function and settings */
    bool has_stats;
    triptych_frame_stats stats;
    /* Text of stats.device, since the renderer may be destroyed before the data set. */
    char device[128];
    /* One per list of the data set, taken from the budget; NULL before the first frame. */
    triptych_list_stats *list_stats;

    trip_image_files files;
};

/* Enters the context's scope for a call and clears the last error. Returns the scope to pass to
 * trip_context_leave(). */
trip_scope *trip_context_enter(triptych *t);
/* Like trip_context_enter(), for a call that does not belong to a begun frame. It also clears an
 * earlier cancellation, unless a frame is begun. */
trip_scope *trip_context_enter_anew(triptych *t);
int trip_context_leave(trip_scope *before, int status);

/* Fails with TRIP_USAGE (reported) if a frame is begun, or if the data set is needed and not open.
 */
int trip_context_check_idle(const triptych *t, bool needs_data);
int trip_context_check_open(const triptych *t);
/* Fails with TRIP_USAGE (reported) if no data set is open or it has no such list. */
int trip_context_check_list(const triptych *t, unsigned number);

/* Like the public functions of the same name, but inside the context's scope, and with checked
 * parameters. */
/* Returns the settings of the renderers. Levels, effects and clipping follow for each frame. */
trip_settings trip_settings_of(const draw_settings *s);
int trip_context_use_transfer_function(triptych *t, const triptych_transfer_function *f);
int trip_context_find_view(triptych *t, const triptych_view *given);
void trip_context_drop_reader(triptych *t);
/* Closes the coarse level. Frames then use the data set itself again. */
void trip_context_drop_level(triptych *t);
/* Returns the clipping in world space. */
trip_clip trip_context_clip(const triptych *t);
/* Also destroys the reader, which may lie in the renderer's memory. */
void trip_context_drop_renderer(triptych *t);
/* Tells whether the next frame takes the value of the nearest voxel. No frame may be begun. */
int trip_context_takes_nearest(triptych *t, bool *out);
/* Chooses the effects of the planned frame and sets them in drawn_settings. */
int trip_context_choose_effects(triptych *t);
/* Prepares the light map and the heat for the planned frame. Destroys them if no effect needs them.
 */
int trip_context_begin_light(triptych *t);
void trip_context_drop_light(triptych *t);
void trip_context_drop_heat(triptych *t);
/* Chooses samples, rays and levels for the planned frame, and sets them in drawn_settings
 * (quality_choice.h). */
int trip_context_choose_quality(triptych *t);
/* Warns if the trial failed. A fault that ends the frame too is then reported only once. */
void trip_context_note_quality(triptych *t);
/* Prints the choice and its error. */
void trip_context_explain_quality(const triptych *t, FILE *out);
/* Prints one line per effect: whether it runs, and why. */
void trip_context_explain_effects(const triptych *t, FILE *out);
/* Records the statistics of the frame, once its picture is complete. */
int trip_context_note_stats(triptych *t);
void trip_context_drop_stats(triptych *t);

/* Gaussian scenes (library_scene.c): like the functions for volumes, inside the context's scope. */
/* Finds the files of a volume or of a Gaussian scene. */
int trip_context_find_files(trip_source *s, const char *path, const trip_volume_params *params);
int trip_context_open_scenes(triptych *t, const triptych_object *objects, unsigned count,
                             uint64_t memory_bytes);
void trip_context_close_scene(triptych *t);
/* Returns whether library_scene.c draws the frames: of Gaussian scenes, or of several objects.
 */
static inline bool trip_context_draws_scene(const triptych *t)
{
    return t->scene || t->mixed;
}
int trip_context_verify_scenes(const triptych *t);
/* Fails with TRIP_USAGE (reported) unless a volume is open. */
int trip_context_check_volume(const triptych *t);
trip_view_object trip_context_scene_object(const triptych *t);
/* Chooses the effects of a frame of a scene, and takes their memory. Its light must be chosen.
 * Destroys the lattices of occlusion if the frame does not need them. */
int trip_context_begin_scene_effects(triptych *t);
/* Applies the effects to a picture without background, with its distances. */
void trip_context_apply_scene_effects(triptych *t, float *rgba, const float *distances);
void trip_context_end_scene_effects(triptych *t);
/* Does a part of the work before the first surfel can be drawn. Returns TRIP_FRAME_DONE or
 * TRIP_FRAME_MORE (renderer.h), or a failure. */
int trip_context_step_scene_effects(triptych *t, uint64_t deadline_ns);
void trip_context_add_scene_effects(const triptych *t, triptych_frame_stats *stats);
void trip_context_drop_openness(triptych *t);
void trip_context_explain_scene_effects(const triptych *t, FILE *out);
int trip_context_begin_scene(triptych *t);
int trip_context_step_scene(triptych *t, uint64_t deadline_ns);
int trip_context_take_scene(triptych *t, float *rgba, float *depth);
void trip_context_end_scene(triptych *t);
void trip_context_explain_scene(const triptych *t, FILE *out);

/* Volumes beside Gaussian scenes (library_mixed.c). */
/* Opens the objects that are volumes; the others are opened as scenes. */
int trip_context_open_mixed(triptych *t, const triptych_object *objects, unsigned count,
                            uint64_t memory_bytes);
void trip_context_close_mixed(triptych *t);
void trip_context_cancel_mixed(triptych *t);
int trip_context_use_mixed_function(triptych *t, const triptych_transfer_function *f);
unsigned trip_context_count_mixed(const triptych *t);
/* Adds the volumes to a box. The first object sets the directions. */
void trip_context_add_mixed(const triptych *t, trip_view_object *object);
int trip_context_begin_mixed(triptych *t, int side);
int trip_context_step_mixed(triptych *t, uint64_t deadline_ns);
/* Waits until the volume of the begun frame has data to draw. */
void trip_context_await_mixed(const triptych *t, uint64_t timeout_ns);
int trip_context_take_mixed(triptych *t, float *rgba, float *depth);
void trip_context_end_mixed(triptych *t);
void trip_context_add_mixed_stats(const triptych *t, triptych_frame_stats *stats);
void trip_context_explain_mixed(const triptych *t, FILE *out);
/* Averages each square of `side` x `side` pixels of `fine`. */
void trip_context_take_means(const float *fine, int side, int width, int height, float *rgba);

/* Reports the progress of bricking. `user` is a context with a progress function. */
void trip_context_show_stage(void *user, const char *stage, uint64_t done, uint64_t total);

/* Returns `wanted`, at most the maximum of a renderer or reader. */
static inline unsigned trip_context_threads(unsigned wanted)
{
    return wanted < TRIP_CONTEXT_MAX_THREADS ? wanted : TRIP_CONTEXT_MAX_THREADS;
}

/* Whether the frame shows values, not splats. Valid once its settings are chosen. */
bool trip_context_draws_values(const triptych *t);

#endif
