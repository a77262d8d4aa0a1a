/* Draws one picture of a Gaussian scene by sheets, in steps: a pass (gaussian_sheets.h) for each
 * axis and direction with weight in the picture, one after the other. The passes are merged with
 * w^2, as lists are. One thread; the runner lends others. */
#ifndef TRIP_GAUSSIAN_SHEET_FRAME_H
#define TRIP_GAUSSIAN_SHEET_FRAME_H

#include "gaussian_picture.h"
#include "placed_stream.h"
#include "settings.h"
#include "task_runner.h"

typedef struct trip_gaussian_sheet_frame trip_gaussian_sheet_frame;

/* The placed set, the camera and the weights must outlive the frame. */
typedef struct trip_gaussian_sheet_frame_params {
    const trip_placed_set *placed; /* one, where it lies */
    const trip_camera *camera;     /* index space is the scene's space */
    trip_gaussian_settings settings;
    const trip_settings *weights; /* method and h */
    double thickness;             /* of a sheet, in units of the scene; above 0 */
    bool reference;
    trip_budget *budget;
    trip_task_runner runner;
} trip_gaussian_sheet_frame_params;

typedef struct trip_gaussian_sheet_frame_stats {
    uint64_t gaussians; /* read, over all passes */
    uint64_t bricks, bytes_read;
    uint64_t held_records; /* greatest number of Gaussians held at once */
    unsigned passes;
    double draw_ms, read_ms;
} trip_gaussian_sheet_frame_stats;

/* Fails (reported) before it reads anything if the budget is too small. */
int trip_gaussian_sheet_frame_begin(trip_gaussian_sheet_frame **out,
                                    const trip_gaussian_sheet_frame_params *params);
/* Draws until the deadline (CLOCK_MONOTONIC), and at least one batch. Returns TRIP_FRAME_DONE or
 * TRIP_FRAME_MORE (renderer.h), or a failure. */
int trip_gaussian_sheet_frame_step(trip_gaussian_sheet_frame *f, uint64_t deadline_ns);
/* Writes the picture drawn so far, as trip_gaussian_frame_picture() does. */
void trip_gaussian_sheet_frame_picture(const trip_gaussian_sheet_frame *f, float *rgba,
                                       float *depth);
trip_gaussian_sheet_frame_stats
trip_gaussian_sheet_frame_get_stats(const trip_gaussian_sheet_frame *f);
void trip_gaussian_sheet_frame_end(trip_gaussian_sheet_frame *f); /* NULL is allowed */

#endif
