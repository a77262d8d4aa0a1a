/* The passes of a deferred picture (surfel_picture.h) on a graphics device. The device keeps the
 * depths, the cells and the sums. surfels_cpu.h projects the surfels and finds the visible ones.
 * All calls come from one thread. Functions return 0 or a failure (reported), unless noted. */
#ifndef TRIP_SURFEL_DEVICE_H
#define TRIP_SURFEL_DEVICE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "budget.h"
#include "surfel_projected.h"

#define TRIP_SURFEL_NO_CELL UINT32_MAX

/* Cells count row by row. A row has width + 2 * TRIP_SURFEL_GUARD of them. */
typedef struct trip_surfel_batch {
    const trip_surfel_projected *surfels;
    const uint32_t *cells; /* TRIP_SURFEL_NO_CELL: not drawn */
    const uint32_t *numbers;
    size_t count;
} trip_surfel_batch;

/* The sums of a pixel. */
typedef struct trip_surfel_sum {
    float rgb[3], weight, tolerance, coverage;
} trip_surfel_sum;

/* One picture on a device. */
typedef struct trip_surfel_target trip_surfel_target;

typedef struct trip_surfel_target_params {
    int width, height; /* pixels */
    bool ortho;
    size_t batch_max; /* surfels of a batch, and cells blended at once */
    trip_budget *budget;
} trip_surfel_target_params;

typedef struct trip_surfel_device {
    void *user;
    /* Begins a picture with infinite depths. Returns 1, without a report, if the budget or the
     * device has too little memory. */
    int (*begin)(void *user, trip_surfel_target **out, const trip_surfel_target_params *params);
    /* Lowers the depths, and lets surfels take their cells. The batch may change afterwards. Writes
     * the greatest depth of each block of level 0 (depth_pyramid.h). */
    int (*add)(trip_surfel_target *t, const trip_surfel_batch *batch, float *greatest);
    /* Writes bits of floats: the depth of each pixel, and z' - t of the surfel in each cell. Writes
     * that surfel's number. All bits are set for an empty cell. Sets the sums to 0. */
    int (*read_depths)(trip_surfel_target *t, uint32_t *depths, uint32_t *fronts,
                       uint32_t *numbers);
    /* Adds the surfels of cells to the sums. */
    int (*blend)(trip_surfel_target *t, const uint32_t *cells, size_t count);
    int (*read_sums)(trip_surfel_target *t, trip_surfel_sum *sums);
    void (*end)(trip_surfel_target *t);
} trip_surfel_device;

#endif
