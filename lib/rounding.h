/* Checks whether layers can hold the splats of a frame. Compositing rounds to the layer's format at
 * each splat. Changes far below one step of the format are lost, however many splats there are. */
#ifndef TRIP_ROUNDING_H
#define TRIP_ROUNDING_H

#include "library_session.h"

/* Returns the largest opacity composited at once, over the values of the data: of a splat, or of a
 * sheet if splats are added by sheet. Returns 0 without visible values. */
double trip_rounding_opacity(const session *s, const trip_settings *settings);
/* Returns the minimum opacity for which layers of this format stay within a tenth of the exact
 * result. The bound holds up to opacities of 3/4. */
double trip_rounding_min(trip_target target);
/* Warns if the opacity is below the minimum. For settings that draw splats. */
void trip_rounding_check(const session *s, const trip_settings *settings);

#endif
