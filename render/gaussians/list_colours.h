/* The view of lists: Gaussians in the colour of the list that they are drawn from. It changes their
 * colours before they are drawn, so all renderers draw the same colours. */
#ifndef TRIP_LIST_COLOURS_H
#define TRIP_LIST_COLOURS_H

#include <stddef.h>

#include "gaussian.h"
#include "settings.h"

/* Colours Gaussians of the list along `axis` by debug_view.h, if the settings show lists. The
 * factor 0.3 + 0.7 x luminance (Rec. 709, of the harmonic of degree 0) keeps their pattern. */
void trip_list_colours(const trip_settings *s, int axis, trip_gaussian *batch, size_t count);

#endif
