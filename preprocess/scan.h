/* What is known of a volume's values once they were all seen: their range, how many are not finite,
 * and a histogram fine enough to make the 1024 bins that transfer functions are made from, although
 * the range is only known at the end. Every thread keeps a tally; tallies are added up. The result
 * depends on the values only, not on their order. */
#ifndef TRIP_SCAN_H
#define TRIP_SCAN_H

#include "envelope.h"
#include "transfer_function.h"
#include "walk.h"

enum { TRIP_TALLY_BINS = 16384 };

/* Cleared by trip_tally_clear(). Fine bin b counts the values in [first + b, first + b + 1) times
 * 2^exponent; the width follows from the range so far and only grows. */
typedef struct trip_tally {
    uint64_t voxels;  /* that exist */
    uint64_t finite;  /* of them */
    uint64_t kept;    /* of them, where an envelope says so */
    uint64_t borders; /* of kept voxels with others along x, where there is an envelope */
    double value_min,
        value_max; /* of the finite ones; infinity and -infinity when there are none */
    uint64_t counted;
    double fit_min, fit_max; /* the range that the bins were last fitted to */
    int exponent;
    int64_t first;
    uint64_t counts[TRIP_TALLY_BINS];
} trip_tally;

void trip_tally_clear(trip_tally *t);
/* Range and numbers of a row; active[i] (NULL: all ones) says which voxels exist. */
void trip_tally_range(trip_tally *t, const float *values, const uint8_t *active, size_t count);
/* Counts the row's finite values into the fine bins; after trip_tally_range() of the same row. */
void trip_tally_count(trip_tally *t, const float *values, const uint8_t *active, size_t count);
void trip_tally_add(trip_tally *t, const trip_tally *other);
/* Whether a tally from a file can have come about: then it is safe to add and to use. */
bool trip_tally_check(const trip_tally *t);
/* What was counted, in 1024 bins over the range. */
void trip_tally_histogram(const trip_tally *t, trip_histogram *histogram);

/* Zero means the default. */
typedef struct trip_scan_params {
    int64_t slices;                /* of a block */
    bool read_ahead;               /* as of trip_walk_params */
    uint64_t stride;               /* look at every so many blocks only; default: at all */
    const trip_envelope *envelope; /* counts what it keeps, instead of filling bins */
    /* Hears of the voxels passed so far; other than 0 ends the pass with that status. */
    int (*progress)(void *user, uint64_t voxels);
    void *user;
    double *passing_seconds; /* as of trip_walk_params */
} trip_scan_params;

/* One pass over the volume, which is rewound after it. All values not finite, or none at all, is a
 * reported failure. */
int trip_scan_volume(trip_tally *out, trip_volume *volume, const char *path, trip_workers *workers,
                     const trip_scan_params *params, trip_budget *budget);

#endif
