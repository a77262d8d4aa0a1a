/* Draws one picture of placed Gaussian scenes or clouds of points, in steps. It streams their
 * Gaussians in the order of drawing, composites them into layers, and merges the layers.
 *
 * - The order by depth has one layer. Its Gaussians come in the order of the centres' view depth.
 * - The order by lists has a layer for each axis with weight in the picture. Its Gaussians come in
 *   the order of their coordinate along the axis, outwards from the eye. Layers are merged with
 *   w^2 (equation 3 of Hofsetz, Max & Bastos 2008; weight.h).
 * - The order by sheets lets Gaussians overlap (gaussian_sheets.h).
 * - The integral has neither order nor layers (gaussian_integral.h).
 * - The deferred picture is for clouds, and has neither (surfel_frame.h).
 *
 * A layer ends early once no pixel takes more. One thread; the runner lends others. */
#ifndef TRIP_GAUSSIAN_FRAME_H
#define TRIP_GAUSSIAN_FRAME_H

#include "gaussian_picture.h"
#include "gaussian_tiles.h"
#include "placed_stream.h"
#include "settings.h"
#include "surfel_frame.h"
#include "task_runner.h"

typedef struct trip_gaussian_frame trip_gaussian_frame;

/* The sets and the camera must outlive the frame. */
typedef struct trip_gaussian_frame_params {
    const trip_placed_set *sets;
    unsigned set_count;
    uint64_t *drawn;           /* Gaussians of each set, added up; NULL: not counted */
    const trip_camera *camera; /* index space is the common space of the sets */
    trip_gaussian_settings settings;
    /* For the orders by lists and by sheets: their method and h. NULL: by depth. */
    const trip_settings *by_lists;
    double sheet; /* thickness of the sheets, in units of the scene; 0: not by sheets */
    /* Width in pixels of the voxels that coarse Gaussians may stand for; 0: none do. Sheets and the
     * integral have none. */
    double lod_px;
    bool reference;               /* draws in double precision, without threads */
    bool integral;                /* has no order */
    bool deferred;                /* has none either */
    trip_surfel_history *history; /* of deferred pictures, see trip_surfel_frame_params */
    double tolerance;             /* of the integral; 0 means the default */
    /* Draw in place of the CPU; NULL for none. They must outlive the frame. */
    const trip_tile_device *device;
    const trip_surfel_device *surfel_device;
    trip_budget *budget;
    trip_task_runner runner;
} trip_gaussian_frame_params;

typedef struct trip_gaussian_frame_stats {
    uint64_t gaussians; /* drawn from the streams, over all layers */
    uint64_t planned;   /* in the plans of the streams */
    uint64_t coarse;    /* in the plans, of coarse levels */
    uint64_t bricks, bytes_read;
    trip_surfel_frame_stats surfels; /* of a deferred picture */
    uint64_t window_records; /* room in the largest window, or Gaussians that meet a sheet */
    unsigned layers;
    double done; /* share of the frame, 0 to 1 */
    double draw_ms, read_ms, merge_ms;
} trip_gaussian_frame_stats;

/* Fails (reported) before it reads anything if the budget is too small. */
int trip_gaussian_frame_begin(trip_gaussian_frame **out, const trip_gaussian_frame_params *params);
/* Draws until the deadline (CLOCK_MONOTONIC), and at least one batch. Returns TRIP_FRAME_DONE or
 * TRIP_FRAME_MORE (renderer.h), or a failure. */
int trip_gaussian_frame_step(trip_gaussian_frame *f, uint64_t deadline_ns);
/* Draws in the order by depth up to `depth` (camera.h). Later Gaussians wait. */
int trip_gaussian_frame_step_to(trip_gaussian_frame *f, double depth, uint64_t deadline_ns);
/* Writes the picture drawn so far: width * height * 4 floats, premultiplied, row 0 at the top, over
 * the background. With settings.depth also width * height distances; otherwise `depth` is NULL. */
int trip_gaussian_frame_picture(trip_gaussian_frame *f, float *rgba, float *depth);
trip_gaussian_frame_stats trip_gaussian_frame_get_stats(const trip_gaussian_frame *f);
void trip_gaussian_frame_end(trip_gaussian_frame *f); /* NULL is allowed */

#endif
