/* What a segment of a ray between two codes shows, codes running straight from one to the other:
 * exact integrals of a transfer function that is linear between the entries of its table, colour
 * and extinction alike. So extinction times colour is a polynomial of degree two between entries,
 * and is integrated as such. All sums are of numbers that are not negative: nothing cancels,
 * however near the codes are. Read-only once made. */
#ifndef TRIP_SEGMENTS_H
#define TRIP_SEGMENTS_H

#include "transfer_function.h"

enum { TRIP_SEGMENT_CODES = 65536 };

/* Over some codes: integrals of extinction k and of k times colour. */
typedef struct trip_segment_sums {
    double k, kq[3];
} trip_segment_sums;

typedef struct trip_segments {
    const trip_tf_entry *table;
    /* A binary tree: node n is the sum of nodes 2n and 2n + 1, node TRIP_SEGMENT_CODES + i is from
     * code i to i + 1. */
    trip_segment_sums nodes[2 * TRIP_SEGMENT_CODES];
} trip_segments;

/* Means over codes from a to b. Without extinction the colour is 0. */
typedef struct trip_segment {
    double extinction; /* per world unit */
    double rgb[3];     /* weighted by extinction */
} trip_segment;

/* The integral from 0 to 1 of the product of two functions that are linear between these values. */
static inline double trip_segment_product(double a0, double a1, double b0, double b1)
{
    return (a0 * (2 * b0 + b1) + a1 * (b0 + 2 * b1)) / 6;
}

/* `table` has TRIP_SEGMENT_CODES entries and outlives it. */
void trip_segments_make(trip_segments *s, const trip_tf_entry *table);

/* Codes are in [0, 65535], whole or not, in any order. */
trip_segment trip_segment_of(const trip_segments *s, double a, double b);

#endif
