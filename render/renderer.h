/* The interface behind which renderers stand: begin frame, for each layer of the plan begin layer
 * and draw its batches in order, picture, end frame. All calls come from one thread at a time.
 * Created once, used for many frames; the frame path does not allocate while sizes stay the same.
 */
#ifndef TRIP_RENDERER_H
#define TRIP_RENDERER_H

#include "camera.h"
#include "plan.h"
#include "reader.h"
#include "report.h"
#include "settings.h"
#include "task_runner.h"
#include "transfer_function.h"

struct trip_field;
struct trip_light_map;
struct trip_emission;

/* Of a list in one frame. Splats about the eye's coordinate, which are in the passes of both ways
 * (plan.h), count once for each. Where frames classify after interpolation nothing is projected: 0.
 */
typedef struct trip_list_stats {
    uint64_t splats_read;      /* handed to the renderer */
    uint64_t splats_projected; /* of those, not culled by w +- dw or behind the eye */
    uint64_t splats_drawn;     /* of those, with a pixel centre of the image in their support where
                                  the layer has weight (whatever their opacity) */
    uint64_t bytes_read;
} trip_list_stats;

/* What a frame is drawn from; outlives the frame. */
typedef struct trip_frame {
    const trip_dataset *data;
    const trip_camera *camera;
    const trip_settings *settings;
    const trip_plan *plan;
    const trip_tf_entry *table; /* 65536 entries */
    /* For the integral renderer: integrate this instead of what batches hold; NULL: those. */
    const struct trip_field *field;
    /* Of frames with shadows or occlusion, but for the integral renderer: begun; else NULL. */
    struct trip_light_map *light;
    struct trip_emission *emission; /* of frames with that effect: begun; else NULL */
    bool count;                     /* splats projected and drawn, too: counting costs time */
    /* Called between batches with how many splats were drawn, of how many: "draw"; and by the
     * integral renderer with how many pixels: "integrate". May be NULL. */
    void (*progress)(void *user, const char *stage, uint64_t done, uint64_t total);
    void *progress_user;
} trip_frame;

/* Between pieces of work that take a few milliseconds: fails (reported) once the frame is no longer
 * wanted. */
static inline int trip_frame_poll(void)
{
    if (!trip_interrupted())
        return TRIP_OK;
    return trip_fail(TRIP_INTERRUPTED, "render", "frame", "interrupted");
}

typedef struct trip_renderer trip_renderer;

/* Most splats of a piece or part, but for a single run. */
#define TRIP_FRAME_PIECE 16384

/* What a step has come to; below 0: failed or cancelled. */
enum {
    TRIP_FRAME_DONE = 0,
    TRIP_FRAME_MORE = 1,  /* more is ready to be done */
    TRIP_FRAME_WAITS = 2, /* nothing is ready: the disk or a graphics device is at work */
};

/* Forms that the papers compare with, which not every renderer draws. */
enum {
    TRIP_DRAWS_FIXED = 1,          /* footprints of a fixed size */
    TRIP_DRAWS_VERTEX_WEIGHTS = 2, /* weights interpolated between vertices */
    TRIP_DRAWS_IMAGE_SHEETS = 4,   /* sheets parallel to the image plane */
};

typedef struct trip_renderer_ops {
    const char *name;     /* "reference", "gl", "cpu", "integral" */
    bool classifies_post; /* draws frames whose settings say so (sheet.h) */
    bool closed_forms;    /* looks nothing up where segments have one (closed_form.h) */
    unsigned effects;     /* draws frames with effects: a bit per trip_classify */
    unsigned forms;       /* sum of TRIP_DRAWS_FIXED, ... */
    void (*destroy)(trip_renderer *r);
    const char *(*device)(const trip_renderer *r);
    int (*begin_frame)(trip_renderer *r, const trip_frame *frame);
    /* Loads a piece of what the renderer keeps of the data set from frame to frame, once what an
     * earlier frame left under way has ended; called between begin_frame and begin_layer until
     * TRIP_FRAME_DONE, and before anything is read. NULL: it keeps and leaves nothing. */
    int (*load)(trip_renderer *r);
    /* Where a call has come to TRIP_FRAME_WAITS, or is_done() to 0: waits until it is to be called
     * again, at most so long. NULL: neither happens. */
    void (*await)(trip_renderer *r, uint64_t timeout_ns);
    /* The layer of `axis` starts empty. Called again until TRIP_FRAME_DONE. */
    int (*begin_layer)(trip_renderer *r, int axis);
    /* Splats of one batch, in draw order; front_to_back false: later ones go over earlier ones. */
    int (*draw)(trip_renderer *r, const trip_batch *batch, bool front_to_back);
    /* Every batch of the frame was drawn, and every layer begun. Called again until
     * TRIP_FRAME_DONE. NULL: nothing is left to do then. */
    int (*end_passes)(trip_renderer *r);
    /* Whether draw() is given whole batches and draws them in parts: it is called again with the
     * same batch until TRIP_FRAME_DONE. Else it is given pieces of batches. */
    bool in_parts;
    /* Memory of the renderer's own for a reader's ring: `count` slots of `bytes`, aligned to 4096;
     * batches that lie there are drawn in place. NULL where it has none to give. It stays the
     * renderer's, which must outlive the reader. NULL: batches may lie anywhere, and are done with
     * when draw() returns. */
    void *const *(*take_slots)(trip_renderer *r, unsigned count, size_t bytes);
    /* Takes that memory back. */
    void (*drop_slots)(trip_renderer *r);
    /* 1: the batch is done with, and its slot may be read into; 0: not yet; negative: failed. NULL
     * where take_slots is. */
    int (*is_done)(trip_renderer *r, const trip_batch *batch);
    /* Merges what the layers hold so far, puts the background behind, and gives width * height * 4
     * floats, premultiplied, row 0 at the top; with settings.depth also width * height distances as
     * layer.h has them, otherwise `depth` is NULL. The frame goes on as if it had not been called;
     * after its last batch it gives the picture. */
    int (*picture)(trip_renderer *r, float *rgba, float *depth);
    /* The frame is over or given up. Waits a moment at most. When it returns, of what the frame is
     * drawn from only the renderer's own memory may still be in use, for which load() waits. NULL:
     * nothing is in use between the other calls. */
    void (*end_frame)(trip_renderer *r);
    /* trip_task_runner.run, of which `user` is the renderer: on its threads, between other calls.
     * NULL: it has none. */
    void (*run_tasks)(void *renderer, void (*task)(void *context, unsigned number), void *context,
                      unsigned count);
    /* Of a list in the frame, by its number in the data set, once the picture was taken
     * (bytes_read is the caller's). */
    trip_list_stats (*stats)(const trip_renderer *r, unsigned list);
} trip_renderer_ops;

/* Every renderer's first member. */
struct trip_renderer {
    const trip_renderer_ops *ops;
    bool resident; /* since begin_frame: it has the frame's splats, and takes runs alone */
    bool software; /* what stands for a graphics device is the processor */
};

/* The renderer's threads. */
static inline trip_task_runner trip_renderer_runner(trip_renderer *r)
{
    return (trip_task_runner){ r->ops->run_tasks, r };
}

int trip_reference_create(trip_renderer **out, trip_budget *budget);
int trip_gl_create(trip_renderer **out, trip_budget *budget);
int trip_cpu_create(trip_renderer **out, trip_budget *budget, unsigned threads);
/* Of frames whose plan is trip_plan_make_field()'s. */
int trip_integral_create(trip_renderer **out, trip_budget *budget, unsigned threads);

#endif
