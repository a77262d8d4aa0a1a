/* Statistics of a volume's values: their range, the number of finite values, and a histogram. The
 * range is known only at the end. Values are therefore counted in fine bins of adaptive width,
 * which give the 1024 bins of the histogram. Each thread fills its own tally; the tallies are then
 * added. The result does not depend on the order of the values. */
#ifndef TRIP_SCAN_H
#define TRIP_SCAN_H

#include "envelope.h"
#include "ids.h"
#include "transfer_function.h"
#include "value_sample.h"
#include "walk.h"

enum { TRIP_TALLY_BINS = 16384 };

/* trip_tally_clear() initialises a tally. Fine bin b counts the values in [first + b, first + b +
 * 1) times 2^exponent. The width of the bins follows from the range so far and only grows. */
typedef struct trip_tally {
    uint64_t voxels; /* existing voxels */
    uint64_t finite; /* existing voxels with a finite value */
    /* Voxels that the envelope keeps, and pairs of neighbours along x with exactly one kept voxel.
     * Both are 0 without an envelope. */
    uint64_t kept, borders;
    double value_min, value_max; /* infinity and -infinity without a finite value */
    uint64_t counted;            /* values in the fine bins */
    double fit_min, fit_max;     /* range at the last fit of the bins */
    int exponent;
    int64_t first;
    uint64_t counts[TRIP_TALLY_BINS];
    /* Range of the values without the few that stand far outside (typical.h), and the numbers of
     * values outside. Not set before trip_typical_set(). */
    uint64_t has_typical; /* 1 if set */
    double typical_min, typical_max;
    uint64_t below, above;
    trip_value_sample sample;
} trip_tally;

void trip_tally_clear(trip_tally *t);
/* Adds a row to the range and to the numbers of voxels. Voxel i exists if active[i] is 1; with NULL
 * all voxels exist. */
void trip_tally_range(trip_tally *t, const float *values, const uint8_t *active, size_t count);
/* Counts the row's finite values in the fine bins. Call trip_tally_range() for the same row first.
 */
void trip_tally_count(trip_tally *t, const float *values, const uint8_t *active, size_t count);
/* Does both, and adds the row to the sample. The row starts at voxel `at`. */
void trip_tally_row(trip_tally *t, const float *values, const uint8_t *active, size_t count,
                    const int64_t at[3]);
void trip_tally_add(trip_tally *t, const trip_tally *other);
/* Returns whether a tally from a file is consistent and therefore safe to use. */
bool trip_tally_check(const trip_tally *t);
/* Computes the histogram with 1024 bins over the typical range or, before it is known, over the
 * range. It leaves out the values outside. */
void trip_tally_histogram(const trip_tally *t, trip_histogram *histogram);

/* Zero selects the default of a field. */
typedef struct trip_scan_params {
    int64_t slices;  /* of a portion */
    bool read_ahead; /* as in trip_walk_params */
    uint64_t stride; /* reads the first of every `stride` batches; by default all batches */
    const trip_envelope *envelope; /* counts the kept voxels instead of filling bins */
    /* If clip_min < clip_max, only values from clip_min to clip_max are put into the bins and the
     * sample. The others are counted. */
    double clip_min, clip_max;
    trip_id_set *ids; /* collects the distinct values of dense volumes; may be NULL */
    /* Gets the number of voxels so far. A status other than 0 ends the scan, which returns the
     * status. */
    int (*progress)(void *user, uint64_t voxels);
    void *user;
    double *skip_seconds; /* as in trip_walk_params */
} trip_scan_params;

/* Walks through the volume once and rewinds it. If a stride finds no finite value, reads the whole
 * volume, since a sample cannot prove that there is none. Fails if the volume has no voxels or no
 * finite value. */
int trip_scan_volume(trip_tally *out, trip_volume *volume, const char *path, trip_workers *workers,
                     const trip_scan_params *params, trip_budget *budget);

#endif
