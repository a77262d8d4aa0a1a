/* Draws a Gaussian scene in double precision, pixel by pixel, as gaussian_picture.h defines it. The
 * caller owns it and calls it from one thread. */
#ifndef TRIP_GAUSSIANS_REFERENCE_H
#define TRIP_GAUSSIANS_REFERENCE_H

#include <stddef.h>

#include "budget.h"
#include "gaussian_picture.h"

typedef struct trip_gaussians_reference trip_gaussians_reference;

/* Begins a picture. Fails (reported) if the budget refuses 48 bytes per pixel. */
int trip_gaussians_reference_begin(trip_gaussians_reference **out, const trip_camera *camera,
                                   const trip_gaussian_settings *settings, trip_budget *budget);
void trip_gaussians_reference_end(trip_gaussians_reference *r);

/* Draws Gaussians behind all earlier ones, the first in front. Fails if it is interrupted. */
int trip_gaussians_reference_add(trip_gaussians_reference *r, const trip_gaussian *gaussians,
                                 size_t count);

/* Writes width * height * 4 floats: premultiplied, row 0 at the top, over the background. With
 * settings.depth it also writes width * height distances; otherwise `depth` is NULL. */
void trip_gaussians_reference_picture(const trip_gaussians_reference *r, float *rgba, float *depth);

#endif
