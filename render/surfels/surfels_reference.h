/* Draws surfels in double precision, one after the other, as surfel_picture.h defines it. The
 * caller owns it and calls it from one thread. */
#ifndef TRIP_SURFELS_REFERENCE_H
#define TRIP_SURFELS_REFERENCE_H

#include <stddef.h>
#include <stdint.h>

#include "budget.h"
#include "gaussian_picture.h"

typedef struct trip_surfels_reference trip_surfels_reference;

/* Begins a picture. Fails (reported) if the budget refuses about 400 bytes per pixel. */
int trip_surfels_reference_begin(trip_surfels_reference **out, const trip_camera *camera,
                                 const trip_gaussian_settings *settings, trip_budget *budget);
void trip_surfels_reference_end(trip_surfels_reference *r); /* NULL is allowed */

/* Adds surfels with the numbers from `first` on. Any order. Fails if it is interrupted. */
int trip_surfels_reference_add(trip_surfels_reference *r, const trip_gaussian *surfels,
                               size_t count, uint32_t first);

/* Writes the picture of the surfels so far: width * height * 4 floats, premultiplied, row 0 at the
 * top, over the background. With settings.depth it also writes width * height distances; otherwise
 * `depth` is NULL. */
void trip_surfels_reference_picture(trip_surfels_reference *r, float *rgba, float *depth);

#endif
