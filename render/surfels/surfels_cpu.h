/* Draws surfels on the CPU, as surfel_picture.h defines it, from batches in any order. The result
 * has the same bits for any number of threads, order and size of batches, and memory. The memory
 * does not depend on the number of surfels. The caller owns it and calls it from one thread; the
 * runner lends it others.
 *
 * Each batch lowers the least depths and the keys of the cells by atomic minima. Then the surfels
 * that hold their cell write themselves into it. Surfels behind the depths of earlier batches are
 * skipped. A pyramid of greatest depths tells this for surfels, and for whole bricks before they
 * are read. */
#ifndef TRIP_SURFELS_CPU_H
#define TRIP_SURFELS_CPU_H

#include <stddef.h>
#include <stdint.h>

#include "budget.h"
#include "gaussian_picture.h"
#include "surfel_device.h"
#include "task_runner.h"

typedef struct trip_surfels_cpu trip_surfels_cpu;

typedef struct trip_surfels_cpu_params {
    const trip_camera *camera;              /* copied */
    const trip_gaussian_settings *settings; /* copied, but not the light */
    trip_budget *budget;
    const trip_task_runner *runner; /* NULL for no threads */
    /* Draws the passes in place of the CPU; NULL for none. It must outlive the picture. */
    const trip_surfel_device *device;
    /* Blends all surfels without selection, as in section 3 of the paper, to compare the times.
     * The renderer then skips no surfel. The sums depend on the order. Not on a device. */
    bool unselected;
} trip_surfels_cpu_params;

typedef struct trip_surfels_cpu_stats {
    uint64_t added;
    /* Added, but not drawn: they do not meet the picture or the clip, or face away. */
    uint64_t outside;
    uint64_t hidden;  /* skipped behind earlier batches */
    uint64_t visible; /* selected and visible in the last picture */
    uint64_t project_ns, blend_ns;
} trip_surfels_cpu_stats;

/* Begins a picture. It takes about 120 bytes per pixel and up to 3 MB for a batch. Fails (reported)
 * if the budget refuses that. */
int trip_surfels_cpu_begin(trip_surfels_cpu **out, const trip_surfels_cpu_params *params);
void trip_surfels_cpu_end(trip_surfels_cpu *s); /* NULL is allowed */

/* Gets surfel `i` of a batch and returns its number. Any thread. */
typedef uint32_t trip_surfel_getter(const void *context, size_t i, trip_gaussian *out);

/* Adds surfels, here with the numbers from `first` on. No number may be added twice. Fails if it is
 * interrupted, or if the device fails. */
int trip_surfels_cpu_add(trip_surfels_cpu *s, const trip_gaussian *surfels, size_t count,
                         uint32_t first);
int trip_surfels_cpu_add_from(trip_surfels_cpu *s, trip_surfel_getter *get, const void *context,
                              size_t count);

/* Without selection: blends surfels. All surfels must be added before the first call, and are
 * blended once. */
int trip_surfels_cpu_blend_from(trip_surfels_cpu *s, trip_surfel_getter *get, const void *context,
                                size_t count);

/* Returns whether surfels change nothing: they reach up to a rectangle, in pixels, and lie behind
 * `depth`, together with their tolerances. The rectangle may exceed the picture. */
bool trip_surfels_cpu_hides(const trip_surfels_cpu *s, const double lo[2], const double hi[2],
                            double depth);

/* Calls `mark` with the number of each visible surfel. */
void trip_surfels_cpu_each_visible(const trip_surfels_cpu *s,
                                   void (*mark)(void *context, uint32_t number), void *context);

/* Writes the picture of the surfels so far: width * height * 4 floats, premultiplied, row 0 at the
 * top, over the background. With settings.depth it also writes width * height distances; otherwise
 * `depth` is NULL. More surfels may be added afterwards. Fails (reported) only on a device. */
int trip_surfels_cpu_picture(trip_surfels_cpu *s, float *rgba, float *depth);

trip_surfels_cpu_stats trip_surfels_cpu_get_stats(const trip_surfels_cpu *s);

#endif
