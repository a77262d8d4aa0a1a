/* Draws one picture of a Gaussian scene as the emission-absorption integral of overlapping
 * Gaussians. The ray of each pixel passes through the sum of their densities (gaussian_profile.h).
 * Overlapping Gaussians mix their colours by density. There is no order and there are no sheets.
 * The order by sheets approximates this picture.
 *
 * All Gaussians in view are kept in memory. A ray is divided adaptively, until at most one density
 * is thinner than an interval. The optical depth up to each point has a closed form. The colour of
 * an interval is extrapolated from one, two and four pieces (Romberg). The sum of the error
 * estimates of a pixel is at most the tolerance.
 *
 * The picture has the same bits for any number of threads and any memory. One thread calls these
 * functions; the runner lends others. */
#ifndef TRIP_GAUSSIAN_INTEGRAL_H
#define TRIP_GAUSSIAN_INTEGRAL_H

#include "budget.h"
#include "gaussian_picture.h"
#include "placed_stream.h"
#include "task_runner.h"

/* The default bound of the error of each component. */
#define TRIP_GAUSSIAN_TOLERANCE 5e-5

typedef struct trip_gaussian_integral trip_gaussian_integral;

/* The sets and the camera must outlive the integral. Distances are not computed. */
typedef struct trip_gaussian_integral_params {
    const trip_placed_set *sets;
    unsigned set_count;
    uint64_t *drawn;           /* Gaussians of each set; NULL: not counted */
    const trip_camera *camera; /* index space is the scene's space */
    trip_gaussian_settings settings;
    double tolerance; /* 0 means TRIP_GAUSSIAN_TOLERANCE */
    trip_budget *budget;
    trip_task_runner runner;
} trip_gaussian_integral_params;

typedef struct trip_gaussian_integral_stats {
    uint64_t gaussians; /* that meet the picture */
    uint64_t bricks, bytes_read, window_records;
    double draw_ms, read_ms;
} trip_gaussian_integral_stats;

/* Fails (reported) before it reads anything if the Gaussians in view do not fit the budget. */
int trip_gaussian_integral_begin(trip_gaussian_integral **out,
                                 const trip_gaussian_integral_params *params);
/* Reads and integrates until the deadline (CLOCK_MONOTONIC). Returns TRIP_FRAME_DONE or
 * TRIP_FRAME_MORE (renderer.h), or a failure. */
int trip_gaussian_integral_step(trip_gaussian_integral *g, uint64_t deadline_ns);
/* Writes width * height * 4 floats: premultiplied, row 0 at the top, over the background. Pixels
 * that are not yet integrated show the background. */
void trip_gaussian_integral_picture(const trip_gaussian_integral *g, float *rgba);
trip_gaussian_integral_stats trip_gaussian_integral_get_stats(const trip_gaussian_integral *g);
void trip_gaussian_integral_end(trip_gaussian_integral *g); /* NULL is allowed */

#endif
