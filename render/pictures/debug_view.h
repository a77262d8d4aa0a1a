/* The debug views of settings.show: colours for lists, levels or weights replace the transfer
 * function's colours. Opacity and light do not change. Pure functions. */
#ifndef TRIP_DEBUG_VIEW_H
#define TRIP_DEBUG_VIEW_H

#include "camera.h"
#include "settings.h"

/* Sets `rgb` to the colour of a list along `axis` at `level`. Returns false if the transfer
 * function's colours apply. */
bool trip_debug_view_of(const trip_settings *settings, int axis, unsigned level, double rgb[3]);

/* Returns the colour of a pixel position in the view of merge weights: the shares w^2 of the X, Y
 * and Z lists as red, green and blue. */
void trip_debug_view_merge(const trip_settings *settings, const trip_camera *camera,
                           int axis_of_view, double x, double y, double rgb[3]);

#endif
