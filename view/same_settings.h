/* Compares two settings member by member. Ignores padding and unused clipping planes. Pure
 * function. */
#ifndef TRIP_VIEW_SAME_SETTINGS_H
#define TRIP_VIEW_SAME_SETTINGS_H

#include <stdbool.h>

#include "triptych.h"

bool trip_same_settings(const triptych_settings *a, const triptych_settings *b);

#endif
