/* The typical range of a volume's values, and values that stand for "no value" without being
 * declared. Both need a complete tally. */
#ifndef TRIP_TYPICAL_H
#define TRIP_TYPICAL_H

#include "scan.h"

/* Sets the tally's typical range: the range without the few values that stand far outside. Most of
 * the range lies between the quantiles of 0.1 % and 99.9 %, without the most frequent value. From
 * there it grows along the sorted values, up to the first large gap. So a tail without gaps belongs
 * to it, and a lone value far outside does not. Also sets `below` and `above`. */
int trip_typical_set(trip_tally *t, const char *path);
/* Sets the typical range to the range. */
void trip_typical_set_whole(trip_tally *t);

/* Adds known fill values that stand far outside of everything else to `fills`: they are further
 * from all other values than the width of the others' typical range. Returns their number, or a
 * negative status. */
int trip_typical_find_fills(const trip_tally *t, const trip_volume_info *info, trip_fills *fills,
                            const char *path);

#endif
