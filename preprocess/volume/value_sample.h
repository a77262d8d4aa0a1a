/* A sample of a volume's values, and the least and the greatest values exactly. The voxels of the
 * sample depend on their positions alone. So neither the threads nor the order of rows change it.
 * Each thread fills its own, and the samples are then added. */
#ifndef TRIP_VALUE_SAMPLE_H
#define TRIP_VALUE_SAMPLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { TRIP_SAMPLE_MAX = 32768, TRIP_EXTREMES = 128 };

/* All zero is an empty sample. Voxel x of row (y, z) has a rank, the number of trailing zeros of x
 * + hash(y, z). The sample holds the values of all voxels with a rank of at least `log2`. It is the
 * lowest number for which they fit. */
typedef struct trip_value_sample {
    uint32_t log2, count;
    uint32_t least_count, greatest_count;
    float least[TRIP_EXTREMES];    /* a heap; the first is its maximum */
    float greatest[TRIP_EXTREMES]; /* a heap; the first is its minimum */
    float values[TRIP_SAMPLE_MAX];
    uint8_t ranks[TRIP_SAMPLE_MAX];
} trip_value_sample;

/* Adds the finite values of a row that starts at voxel `at`. Voxel i exists if active[i] is 1; with
 * NULL all voxels exist. */
void trip_value_sample_add_row(trip_value_sample *s, const float *values, const uint8_t *active,
                               size_t count, const int64_t at[3]);
void trip_value_sample_add(trip_value_sample *s, const trip_value_sample *other);
/* Whether a sample from a file is one of `finite` values from `lo` to `hi`. */
bool trip_value_sample_check(const trip_value_sample *s, uint64_t finite, double lo, double hi);

/* Returns all values in ascending order, and sets *count: the extremes, and the sample between
 * them. Free them with free(). NULL means that memory is exhausted. */
float *trip_value_sample_sorted(const trip_value_sample *s, size_t *count);
/* Sorts floats without NaN. */
void trip_value_sample_sort(float *values, size_t count);

#endif
