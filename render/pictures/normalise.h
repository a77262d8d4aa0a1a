/* Divides the colours of a picture by its accumulated opacity (Hofsetz & Max 2005, section 5, step
 * 3). Each covered pixel becomes opaque in its mean colour. Pure functions. */
#ifndef TRIP_NORMALISE_H
#define TRIP_NORMALISE_H

#include <stddef.h>

/* Pixels with at most this opacity are background; the paper drops fragments with at most this
 * opacity. */
#define TRIP_NORMALISE_MIN 1e-4

/* Normalises premultiplied pixels without background, and puts a background (not premultiplied)
 * behind them. */
void trip_normalise(float *rgba, size_t pixels, const double background[4]);

/* Puts a background behind pixels without normalising them. */
void trip_put_behind(float *rgba, size_t pixels, const double background[4]);

#endif
