/* Whether layers can hold the splats of a frame: what is composited is rounded to the layers'
 * format each time, and what is far below a step of that is lost, however many there are. */
#ifndef TRIP_ROUNDING_H
#define TRIP_ROUNDING_H

#include "library_session.h"

/* The largest opacity that is composited at once, of a splat or, by sheets, of a sheet, over the
 * values that the data have; 0 without any. */
double trip_rounding_opacity(const session *s, const trip_settings *settings);
/* What it has to be at least for layers of the format to come within a tenth of what they should
 * hold, up to opacities of 3/4. */
double trip_rounding_min(trip_target target);
/* Warns where it is less. Of settings that draw splats. */
void trip_rounding_check(const session *s, const trip_settings *settings);

#endif
