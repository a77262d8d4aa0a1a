/* Whether two settings of a frame are the same, member by member: what lies between members does
 * not count, nor do planes of a clip beyond those there are. Pure. */
#ifndef TRIP_VIEW_SAME_SETTINGS_H
#define TRIP_VIEW_SAME_SETTINGS_H

#include <stdbool.h>

#include "triptych.h"

bool trip_same_settings(const triptych_settings *a, const triptych_settings *b);

#endif
