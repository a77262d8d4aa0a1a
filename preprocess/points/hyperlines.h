/* Fuses range images into points with colours from several cameras (hyperline.h). It works through
 * the frames in their order, with at most TRIP_HYPERLINE_OTHERS others beside the one in hand:
 * those with the nearest positions and directions. So memory does not grow with the number of
 * frames.
 *
 * A sample of a frame is projected into each other frame. It agrees with the other frame if the
 * distances of the four pixels about it differ from its own by at most
 *
 *     3 sqrt(sigma^2 + sigma'^2) + 0.01 z'
 *
 * and if the cosine of its normal and the ray to the other camera is above 0.2. sigma and sigma'
 * are the noise of the distances alone. A sample is left out if an earlier frame agrees, unless its
 * pixels are more than 1.25 times as wide on the surface. Only earlier frames count,
 * so one of the frames that agree always keeps its sample. The sample moves along its normal to the
 * mean of the agreeing surfaces, weighted by 1 / sigma^2. It keeps the colours of at most
 * TRIP_HYPERLINE_CAMERAS cameras: its own, and then each time the one with the greatest angle from
 * those kept. Normal and radius are the ones of its frame. The radius is greater beside a step
 * of up to 2 sigma to one of the four pixels beside it: the disc reaches across. */
#ifndef TRIP_HYPERLINES_H
#define TRIP_HYPERLINES_H

#include "budget.h"
#include "gaussian.h"

enum { TRIP_HYPERLINE_OTHERS = 40 };

typedef struct trip_hyperlines trip_hyperlines;

/* Opens a folder or a file of range images. All frames must have colours. The images in memory
 * count towards the budget. `threads` 0 means one for each processor. */
int trip_hyperlines_open(trip_hyperlines **out, const char *path, unsigned threads,
                         trip_budget *budget);
void trip_hyperlines_close(trip_hyperlines *h); /* NULL is allowed */

/* A trip_gaussian_source of surfels with `factor` times their radius. */
int trip_hyperlines_read(void *hyperlines, trip_gaussian *out, size_t room, size_t *got);
void trip_hyperlines_set_factor(trip_hyperlines *h, double factor);

/* Return the number of samples read, and of samples that another frame has. */
uint64_t trip_hyperlines_samples(const trip_hyperlines *h);
uint64_t trip_hyperlines_fused(const trip_hyperlines *h);

#endif
