/* Draws one deferred picture of placed clouds of points, in steps: plans the bricks in view, reads
 * them from front to back, and draws them (surfels_cpu.h). Bricks behind the depths so far are not
 * read. The picture has the same bits for any memory, number of threads and history. One thread;
 * the runner lends others. */
#ifndef TRIP_SURFEL_FRAME_H
#define TRIP_SURFEL_FRAME_H

#include "gaussian_picture.h"
#include "placed_stream.h"
#include "surfel_device.h"
#include "surfel_plan.h"
#include "task_runner.h"

typedef struct trip_surfel_frame trip_surfel_frame;

/* The sets and the camera must outlive the frame. */
typedef struct trip_surfel_frame_params {
    const trip_placed_set *sets;
    unsigned set_count;
    uint64_t *drawn;           /* surfels read of each set, added up; NULL: not counted */
    const trip_camera *camera; /* index space is the common space of the sets */
    trip_gaussian_settings settings;
    double lod_px;  /* as in trip_gaussian_lod */
    bool reference; /* draws in double precision, without threads, and reads all bricks in view */
    /* Bricks of an earlier picture of the same sets. The complete picture replaces them. It must
     * outlive the frame; NULL: none. */
    trip_surfel_history *history;
    const trip_surfel_device *device; /* as in trip_surfels_cpu_params */
    bool unselected;                  /* blends all surfels, and reads them twice (surfels_cpu.h) */
    trip_budget *budget;
    trip_task_runner runner;
} trip_surfel_frame_params;

typedef struct trip_surfel_frame_stats {
    unsigned objects; /* in view */
    uint64_t planned; /* surfels of bricks in view */
    uint64_t coarse;  /* of these */
    uint64_t read;
    uint64_t away;    /* planned, and facing away as bricks */
    uint64_t unread;  /* planned, and hidden as bricks */
    uint64_t outside; /* read, and outside the picture, or facing away */
    uint64_t hidden;  /* read, and hidden */
    uint64_t visible; /* in the last picture */
    uint64_t bricks, bytes_read;
    double done; /* share of the frame, 0 to 1 */
    double read_ms, project_ms, blend_ms;
} trip_surfel_frame_stats;

/* Fails (reported) before it reads anything if the budget is too small. */
int trip_surfel_frame_begin(trip_surfel_frame **out, const trip_surfel_frame_params *params);
/* Draws until the deadline (CLOCK_MONOTONIC), and at least one batch. Returns TRIP_FRAME_DONE or
 * TRIP_FRAME_MORE (renderer.h), or a failure. */
int trip_surfel_frame_step(trip_surfel_frame *f, uint64_t deadline_ns);
/* Writes the picture drawn so far, as trip_surfels_cpu_picture() does. */
int trip_surfel_frame_picture(trip_surfel_frame *f, float *rgba, float *depth);
trip_surfel_frame_stats trip_surfel_frame_get_stats(const trip_surfel_frame *f);
void trip_surfel_frame_end(trip_surfel_frame *f); /* NULL is allowed */

#endif
