/* Colours that stand for what a picture is made of, in place of the transfer function's: settings
 * with `show`. Opacity and light stay what they are. Pure. */
#ifndef TRIP_DEBUG_VIEW_H
#define TRIP_DEBUG_VIEW_H

#include "camera.h"
#include "settings.h"

/* What is drawn of a list along `axis` at `level` has the colour `rgb`; false: its own. */
bool trip_debug_view_of(const trip_settings *settings, int axis, unsigned level, double rgb[3]);

/* What a pixel position of a merge map looks like: the shares w^2 of the lists along x, y and z as
 * red, green and blue. */
void trip_debug_view_merge(const trip_settings *settings, const trip_camera *camera,
                           int axis_of_view, double x, double y, double rgb[3]);

#endif
