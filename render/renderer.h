/* The interface that all renderers implement. A frame calls begin_frame, then for each layer of the
 * plan begin_layer and draw for its batches in order, then picture and end_frame. Calls come from
 * one thread at a time. A renderer is created once and draws many frames; drawing a frame does not
 * allocate while sizes stay the same. */
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
struct trip_tile_device;
struct trip_surfel_device;

/* Counts of one list in one frame. Splats near the eye's coordinate that belong to both passes
 * (plan.h) count once per pass. `post` projects no splats and counts 0. */
typedef struct trip_list_stats {
    uint64_t splats_read;      /* passed to the renderer */
    uint64_t splats_projected; /* read, and not culled by w +- dw or behind the eye */
    /* Projected, and their support contains a pixel centre where the layer has weight, whatever
     * their opacity. */
    uint64_t splats_drawn;
    uint64_t bytes_read;
} trip_list_stats;

enum { TRIP_FRAME_ROWS = 32 };

/* The inputs of a frame; they must outlive it. */
typedef struct trip_frame {
    const trip_dataset *data;
    const trip_camera *camera;
    const trip_settings *settings;
    const trip_plan *plan;
    const trip_tf_entry *table;
    /* For the integral renderer: the field to integrate. NULL selects the voxels of the batches. */
    const struct trip_field *field;
    /* Light for frames with shadows or occlusion, begun before the frame. NULL in other frames and
     * for the integral renderer. */
    struct trip_light_map *light;
    struct trip_emission *emission; /* begun, in frames with that effect; else NULL */
    /* The rows of the picture to draw, if `rows` is not 0: for values and the CPU renderer only.
     * Both are multiples of TRIP_FRAME_ROWS, except at the end of the picture. Pixels have the same
     * bits as in the whole picture. */
    int first_row, rows;
    bool count; /* also count projected and drawn splats, which takes time */
    /* Called between batches with the stage "draw" and the number of splats. The integral renderer
     * calls it with "integrate" and the number of pixels. May be NULL. */
    void (*progress)(void *user, const char *stage, uint64_t done, uint64_t total);
    void *progress_user;
} trip_frame;

/* Fails (reported) once the frame is no longer wanted. Renderers call it every few milliseconds. */
static inline int trip_frame_poll(void)
{
    if (!trip_interrupted())
        return TRIP_OK;
    return trip_fail(TRIP_INTERRUPTED, "render", "frame", "interrupted");
}

typedef struct trip_renderer trip_renderer;

/* Maximum number of splats in a piece or part of a batch. A single run may exceed it. */
#define TRIP_FRAME_PIECE 16384

/* The result of a step. Negative results mean failed or cancelled. */
enum {
    TRIP_FRAME_DONE = 0,
    TRIP_FRAME_MORE = 1,  /* more work is ready */
    TRIP_FRAME_WAITS = 2, /* no work is ready: the disk or a graphics device is busy */
};

/* Forms of splatting from the papers that only some renderers draw. */
enum {
    TRIP_DRAWS_FIXED = 1,
    TRIP_DRAWS_VERTEX_WEIGHTS = 2, /* weights interpolated between a splat's corners */
    TRIP_DRAWS_IMAGE_SHEETS = 4,
};

typedef struct trip_renderer_ops {
    const char *name;     /* "reference", "gl", "cpu", "integral" */
    bool classifies_post; /* draws frames with classify post (sheet.h) */
    bool blurs;           /* deviations of coarse values blur its function (sheet.h) */
    bool closed_forms;    /* needs no lookup if segments have a closed form (closed_form.h) */
    unsigned effects;     /* draws frames with effects; a bit per trip_classify */
    unsigned forms;       /* sum of TRIP_DRAWS_FIXED, ... */
    void (*destroy)(trip_renderer *r);
    const char *(*device)(const trip_renderer *r);
    int (*begin_frame)(trip_renderer *r, const trip_frame *frame);
    /* Loads a piece of the data that the renderer keeps from frame to frame, after the work of an
     * earlier frame has ended. Called after begin_frame and before any read, until it returns
     * TRIP_FRAME_DONE. NULL if the renderer keeps no such data. */
    int (*load)(trip_renderer *r);
    /* Waits for at most `timeout_ns`, after a call returned TRIP_FRAME_WAITS or is_done() returned
     * 0, until that call is worth repeating. NULL if neither happens. */
    void (*await)(trip_renderer *r, uint64_t timeout_ns);
    /* Starts the layer of `axis` empty. Called again until TRIP_FRAME_DONE. */
    int (*begin_layer)(trip_renderer *r, int axis);
    /* Draws the splats of one batch in draw order. If front_to_back is false, later splats are
     * drawn over earlier ones. */
    int (*draw)(trip_renderer *r, const trip_batch *batch, bool front_to_back);
    /* Called after all batches are drawn and all layers begun, again until TRIP_FRAME_DONE. NULL if
     * no work is left by then. */
    int (*end_passes)(trip_renderer *r);
    /* If true, draw() gets whole batches and is called with the same batch until TRIP_FRAME_DONE.
     * If false, draw() gets pieces of batches. */
    bool in_parts;
    /* Returns memory of the renderer for a reader's ring: `count` slots of `bytes`, aligned to
     * 4096. It draws batches in these slots in place. The renderer keeps the ownership and must
     * outlive the reader. Returns NULL if it has no such memory. The function is NULL if batches
     * may lie anywhere; draw() is then done with a batch when it returns. */
    void *const *(*take_slots)(trip_renderer *r, unsigned count, size_t bytes);
    /* Takes the memory of take_slots back. */
    void (*drop_slots)(trip_renderer *r);
    /* Returns 1 if the batch is finished and its slot may be overwritten, 0 if not yet, or a
     * negative failure. NULL if take_slots is NULL. */
    int (*is_done)(trip_renderer *r, const trip_batch *batch);
    /* Merges the current layers over the background. Writes width * height * 4 floats:
     * premultiplied, row 0 at the top. With settings.depth it also writes width * height distances
     * (layer.h); otherwise `depth` is NULL. The frame is unchanged and may continue. After the last
     * batch the result is the final picture. */
    int (*picture)(trip_renderer *r, float *rgba, float *depth);
    /* Ends a frame, complete or not. It waits for a moment at most. On return only the renderer's
     * own memory may still be in use, and load() waits for that. NULL if nothing is in use between
     * calls. */
    void (*end_frame)(trip_renderer *r);
    /* Implements trip_task_runner.run on the renderer's threads, between other calls. `renderer` is
     * the runner's user pointer. NULL if the renderer has no threads. */
    void (*run_tasks)(void *renderer, void (*task)(void *context, unsigned number), void *context,
                      unsigned count);
    /* Returns the device that composites the tiles of Gaussian scenes (gaussian_tiles.h). The
     * renderer owns it. NULL if the renderer has none. */
    const struct trip_tile_device *(*tile_device)(trip_renderer *r);
    /* Returns the device for deferred pictures (surfel_device.h), likewise. */
    const struct trip_surfel_device *(*surfel_device)(trip_renderer *r);
    /* Returns the counts of a list, by its index in the data set, after picture(). The caller
     * counts bytes_read. */
    trip_list_stats (*stats)(const trip_renderer *r, unsigned list);
} trip_renderer_ops;

/* The first member of every renderer. */
struct trip_renderer {
    const trip_renderer_ops *ops;
    bool resident; /* set by begin_frame: it holds the frame's splats and needs only the runs */
    bool software; /* its graphics device is emulated by the processor */
};

static inline trip_task_runner trip_renderer_runner(trip_renderer *r)
{
    return (trip_task_runner){ r->ops->run_tasks, r };
}

int trip_reference_create(trip_renderer **out, trip_budget *budget);
int trip_gl_create(trip_renderer **out, trip_budget *budget);
int trip_cpu_create(trip_renderer **out, trip_budget *budget, unsigned threads);
/* For frames with a plan made by trip_plan_make_field(). */
int trip_integral_create(trip_renderer **out, trip_budget *budget, unsigned threads);

#endif
