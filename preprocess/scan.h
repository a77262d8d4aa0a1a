/* Statistics of a volume's values: their range, how many are finite, and a histogram. The range is
 * known only at the end; therefore values are counted in fine bins of adaptive width, from which
 * the 1024 bins that transfer functions are made from are computed. Every thread fills a tally of
 * its own; tallies are added up. The result does not depend on the order of the values. */
#ifndef TRIP_SCAN_H
#define TRIP_SCAN_H

#include "envelope.h"
#include "transfer_function.h"
#include "walk.h"

enum { TRIP_TALLY_BINS = 16384 };

/* Made by trip_tally_clear(). Fine bin b counts the values in [first + b, first + b + 1) times
 * 2^exponent; the width follows from the range so far and only grows. */
typedef struct trip_tally {
    uint64_t voxels; /* existing ones */
    uint64_t finite; /* of these, with a finite value */
    /* Of these, kept by the envelope, and pairs of neighbours along x of which one is kept; 0 where
     * there is no envelope. */
    uint64_t kept, borders;
    double value_min,
        value_max;           /* of the finite ones; infinity and -infinity when there are none */
    uint64_t counted;        /* in the fine bins */
    double fit_min, fit_max; /* the range that the bins were last fitted to */
    int exponent;
    int64_t first;
    uint64_t counts[TRIP_TALLY_BINS];
} trip_tally;

void trip_tally_clear(trip_tally *t);
/* Adds a row to the range and to the numbers of voxels; voxel i exists where active[i] is 1 (NULL:
 * all exist). */
void trip_tally_range(trip_tally *t, const float *values, const uint8_t *active, size_t count);
/* Counts the row's finite values into the fine bins; after trip_tally_range() of the same row. */
void trip_tally_count(trip_tally *t, const float *values, const uint8_t *active, size_t count);
void trip_tally_add(trip_tally *t, const trip_tally *other);
/* Whether a tally from a file is consistent, and so safe to add and to use. */
bool trip_tally_check(const trip_tally *t);
/* The counts in 1024 bins over the range. */
void trip_tally_histogram(const trip_tally *t, trip_histogram *histogram);

/* Zero means the default. */
typedef struct trip_scan_params {
    int64_t slices;                /* of a portion */
    bool read_ahead;               /* as in trip_walk_params */
    uint64_t stride;               /* of `stride` batches the first is read; default: all are */
    const trip_envelope *envelope; /* count what it keeps, instead of filling bins */
    /* Called with the number of voxels so far; a status other than 0 ends the scan with it. */
    int (*progress)(void *user, uint64_t voxels);
    void *user;
    double *skip_seconds; /* as in trip_walk_params */
} trip_scan_params;

/* Walks through the volume once and rewinds it. Where a stride finds no finite value, all is read:
 * a sample does not say that there is none. A volume without voxels or without a finite value is a
 * reported failure. */
int trip_scan_volume(trip_tally *out, trip_volume *volume, const char *path, trip_workers *workers,
                     const trip_scan_params *params, trip_budget *budget);

#endif
