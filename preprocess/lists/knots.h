/* Codes that follow the values of a volume: 256 intervals with 256 even codes each. Dense
 * values have short intervals. Pure functions. */
#ifndef TRIP_KNOTS_H
#define TRIP_KNOTS_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

enum { TRIP_KNOT_INTERVALS = 256, TRIP_KNOT_STEP_LOG2 = 8, TRIP_KNOTS = TRIP_KNOT_INTERVALS + 1 };

/* Knot n is the value of code 256 n (codes.h). Knots strictly ascend. */
typedef struct trip_knots {
    double values[TRIP_KNOTS];
    double codes_per_value[TRIP_KNOT_INTERVALS]; /* in each interval */
} trip_knots;

/* The values that knots serve. */
typedef struct trip_knots_params {
    const float *kept, *all; /* sorted samples: values of kept voxels, and of all voxels */
    size_t kept_count, all_count;
    double lo, hi;               /* all values lie between them, and hi is above lo */
    double likely_lo, likely_hi; /* range with even codes of its own */
} trip_knots_params;

/* Half of the knots follow the kept values, a quarter all values. The others are even over the
 * likely range and over the whole range. */
void trip_knots_make(trip_knots *k, const trip_knots_params *params);

/* Returns the nearest code. Values outside get the first or last code, NaN gets the first. */
static inline uint32_t trip_knots_code(const trip_knots *k, double value)
{
    size_t at = 0; /* the search has no branches, since they could not be predicted */
    for (size_t step = TRIP_KNOT_INTERVALS / 2; step > 0; step /= 2)
        at += step & -(size_t)(k->values[at + step] <= value);
    const double code = (double)(at << TRIP_KNOT_STEP_LOG2) +
                        (value - k->values[at]) * k->codes_per_value[at] + 0.5;
    return !(code > 0) ? 0 : code >= 65535 ? 65535 : (uint32_t)code;
}

#endif
