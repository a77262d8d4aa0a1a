/* The set of visible codes: one bit per code, and one bit per 64 codes that is set if any of them
 * is in the set. Plain values. */
#ifndef TRIP_CODE_SET_H
#define TRIP_CODE_SET_H

#include <stdbool.h>
#include <stdint.h>

#include "transfer_function.h"

typedef struct trip_code_range {
    uint16_t min, max; /* min > max if empty */
} trip_code_range;

typedef struct trip_code_set {
    uint64_t codes[1024], some[16];
} trip_code_set;

/* Collects the codes of a table of 65536 entries with at least this extinction, which is above 0.
 */
void trip_code_set_make(trip_code_set *set, const trip_tf_entry *table, double min);

/* Drops all codes outside of a range. */
void trip_code_set_keep(trip_code_set *set, trip_code_range range);

/* Returns whether any code from first to last is in the set. */
bool trip_code_set_has_some(const trip_code_set *set, unsigned first, unsigned last);

/* Returns the range of the codes if they are contiguous, else an empty range. */
trip_code_range trip_code_set_range(const trip_code_set *set);

static inline bool trip_code_set_has(const trip_code_set *set, unsigned code)
{
    return set->codes[code / 64] >> (code % 64) & 1;
}

#endif
