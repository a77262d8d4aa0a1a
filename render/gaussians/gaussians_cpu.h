/* Draws a Gaussian scene on the CPU, as gaussian_picture.h defines it, from batches in the order of
 * drawing. The result has the same bits for any number of threads, size of batches, memory and
 * instruction set. The memory does not depend on the number of Gaussians. The caller owns it and
 * calls it from one thread; the runner lends it others.
 *
 * Each batch is projected, then listed tile by tile in its order, then composited tile by tile. A
 * tile is closed once none of its pixels takes more. Closed tiles cost nothing.
 *
 * With a device, the CPU projects and lists, and the device composites. Gaussians then wait for a
 * full batch, and closed tiles become known some pieces later. Pictures may differ by rounding. */
#ifndef TRIP_GAUSSIANS_CPU_H
#define TRIP_GAUSSIANS_CPU_H

#include <stddef.h>
#include <stdint.h>

#include "budget.h"
#include "gaussian_picture.h"
#include "gaussian_tiles.h"
#include "task_runner.h"

typedef struct trip_gaussians_cpu trip_gaussians_cpu;

typedef struct trip_gaussians_cpu_params {
    const trip_camera *camera;              /* copied */
    const trip_gaussian_settings *settings; /* copied */
    trip_budget *budget;
    const trip_task_runner *runner; /* NULL for no threads */
    const char *isa; /* NULL selects the widest instruction set, see trip_tile_kernels_choose() */
    /* Composites the tiles in place of the kernels; NULL for none. It must outlive the picture. */
    const trip_tile_device *device;
} trip_gaussians_cpu_params;

typedef struct trip_gaussians_cpu_stats {
    uint64_t added, drawn; /* Gaussians given, and those that met open tiles */
    uint64_t pairs;        /* of a Gaussian and a tile */
    uint64_t project_ns, bin_ns, composite_ns;
} trip_gaussians_cpu_stats;

/* Begins a picture. It takes 16 bytes per pixel, 20 with depth, and 0.2 to 6 MB for a batch, or
 * more for pictures above 8 megapixels. Fails (reported) if the budget refuses that, or if the
 * instruction set cannot run here. */
int trip_gaussians_cpu_begin(trip_gaussians_cpu **out, const trip_gaussians_cpu_params *params);
void trip_gaussians_cpu_end(trip_gaussians_cpu *g);

/* Draws Gaussians behind all earlier ones, the first in front. Fails if it is interrupted. */
int trip_gaussians_cpu_add(trip_gaussians_cpu *g, const trip_gaussian *gaussians, size_t count);

/* Draws the Gaussians that wait for a full batch. trip_gaussians_cpu_picture() does so too. */
int trip_gaussians_cpu_flush(trip_gaussians_cpu *g);

/* Returns whether a tile is open that has a pixel in the rectangle, in pixels. A Gaussian that only
 * meets closed tiles changes nothing. */
bool trip_gaussians_cpu_is_open(const trip_gaussians_cpu *g, const double lo[2],
                                const double hi[2]);
/* Returns whether a brick of Gaussians may change the picture. All its centres lie in the box, in
 * scene space, and its deviations are at most `deviation`. The caller checks the clip. */
bool trip_gaussians_cpu_needs_box(const trip_gaussians_cpu *g, const double lo[3],
                                  const double hi[3], double deviation);
/* Returns the number of open tiles. */
size_t trip_gaussians_cpu_open_tiles(const trip_gaussians_cpu *g);

/* Writes width * height * 4 floats: premultiplied, row 0 at the top, over the background. With
 * settings.depth it also writes width * height distances; otherwise `depth` is NULL. The picture
 * may continue afterwards. Only a device can fail. */
int trip_gaussians_cpu_picture(trip_gaussians_cpu *g, float *rgba, float *depth);

trip_gaussians_cpu_stats trip_gaussians_cpu_get_stats(const trip_gaussians_cpu *g);

#endif
