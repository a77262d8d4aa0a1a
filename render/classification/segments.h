/* Computes the extinction and colour of a ray segment along which the code changes linearly from
 * one value to another. The results are exact integrals of a transfer function that is linear
 * between the entries of its table. Extinction times colour is then a polynomial of degree two
 * between entries. All sums add non-negative numbers, so that nothing cancels, however close the
 * codes are. Read-only once made; any thread may use it. */
#ifndef TRIP_SEGMENTS_H
#define TRIP_SEGMENTS_H

#include "transfer_function.h"

enum { TRIP_SEGMENT_CODES = 65536 };

/* Integrals over a range of codes: extinction k, and k times colour. */
typedef struct trip_segment_sums {
    double k, kq[3];
} trip_segment_sums;

typedef struct trip_segments {
    const trip_tf_entry *table;
    /* A binary tree. Node n is the sum of nodes 2n and 2n + 1. Node TRIP_SEGMENT_CODES + i covers
     * the codes from i to i + 1. */
    trip_segment_sums nodes[2 * TRIP_SEGMENT_CODES];
} trip_segments;

/* Means over the codes from a to b. Without extinction the colour is 0. */
typedef struct trip_segment {
    double extinction; /* per world unit */
    double rgb[3];     /* weighted by extinction */
} trip_segment;

/* Returns the integral from 0 to 1 of the product of two linear functions. The first goes from a0
 * to a1, the second from b0 to b1. */
static inline double trip_segment_product(double a0, double a1, double b0, double b1)
{
    return (a0 * (2 * b0 + b1) + a1 * (b0 + 2 * b1)) / 6;
}

/* `table` has TRIP_SEGMENT_CODES entries and must outlive `s`. */
void trip_segments_make(trip_segments *s, const trip_tf_entry *table);

/* The codes may have any order and need not be whole. Below code 0 and above code 65535 the
 * function is constant. */
trip_segment trip_segment_of(const trip_segments *s, double a, double b);

#endif
