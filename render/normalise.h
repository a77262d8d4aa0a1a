/* The colour of a picture divided by its accumulated opacity (Hofsetz & Max 2005, section 5, step
 * 3): what is covered at all shows its mean colour, opaque. Pure. */
#ifndef TRIP_NORMALISE_H
#define TRIP_NORMALISE_H

#include <stddef.h>

/* Pixels of at most this opacity are the background: fragments of it are dropped in the paper. */
#define TRIP_NORMALISE_MIN 1e-4

/* Of premultiplied pixels drawn over a transparent background, and the background (not
 * premultiplied) that is put behind. */
void trip_normalise(float *rgba, size_t pixels, const double background[4]);

/* The same background behind pixels as they are. */
void trip_put_behind(float *rgba, size_t pixels, const double background[4]);

#endif
