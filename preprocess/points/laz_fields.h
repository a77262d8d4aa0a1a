/* Parts that the points of both generations of LAZ share: the order of returns, running medians,
 * sequences of GPS times, and colours. One thread at a time. */
#ifndef TRIP_LAZ_FIELDS_H
#define TRIP_LAZ_FIELDS_H

#include "laz_codes.h"

/* The median of the last differences. Zeroed at first. The smallest and the largest value leave it
 * in turns. */
typedef struct trip_laz_median {
    int32_t values[5]; /* ascending */
    bool low_leaves;   /* the smallest value leaves next */
} trip_laz_median;

void trip_laz_median_add(trip_laz_median *m, int32_t value);

static inline int32_t trip_laz_median_of(const trip_laz_median *m)
{
    return m->values[2];
}

/* Four interleaved sequences of times. Zeroed at first. */
typedef struct trip_laz_times {
    trip_laz_model multiples, first_multiples;
    trip_laz_integers differences;
    uint64_t last[4]; /* bits of doubles, as integers */
    int32_t difference[4];
    uint32_t extremes[4]; /* multiples in a row beyond the coded ones */
    unsigned current, newest;
} trip_laz_times;

void trip_laz_times_begin(trip_laz_times *t, uint64_t first);
/* Returns the bits of the next time. `layered`: the code lacks a symbol for an equal time. */
uint64_t trip_laz_times_next(trip_laz_times *t, trip_laz_decoder *d, bool layered);

/* Colours of three times 16 bits. Zeroed at first. */
typedef struct trip_laz_colours {
    trip_laz_model changed, bytes[6];
} trip_laz_colours;

/* Replaces the colour before by the next one. */
void trip_laz_colours_next(trip_laz_colours *c, trip_laz_decoder *d, uint16_t rgb[3]);

#endif
