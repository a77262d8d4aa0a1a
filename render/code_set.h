/* A set of codes, those that a transfer function shows: a bit each, and a bit for each 64 of them
 * of which some are in it. */
#ifndef TRIP_CODE_SET_H
#define TRIP_CODE_SET_H

#include <stdbool.h>
#include <stdint.h>

#include "transfer_function.h"

typedef struct trip_code_range {
    uint16_t min, max; /* least > most: no codes */
} trip_code_range;

typedef struct trip_code_set {
    uint64_t codes[1024], some[16];
} trip_code_set;

/* Of a table of 65536 entries: those with at least so much extinction, which is above 0. */
void trip_code_set_make(trip_code_set *set, const trip_tf_entry *table, double min);

/* Whether some code from first to last is in it. */
bool trip_code_set_has_some(const trip_code_set *set, unsigned first, unsigned last);

/* All of its codes, where they follow one another without a gap; else none. */
trip_code_range trip_code_set_range(const trip_code_set *set);

static inline bool trip_code_set_has(const trip_code_set *set, unsigned code)
{
    return set->codes[code / 64] >> (code % 64) & 1;
}

#endif
