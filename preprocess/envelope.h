/* The opacity envelope: which values make a splat. It is the union of transfer functions (values
 * whose opacity is above 0) and of value ranges, held as the exact set of float32 values that
 * belong to it: closed intervals, disjoint and ascending. Built by one thread, then read-only. */
#ifndef TRIP_ENVELOPE_H
#define TRIP_ENVELOPE_H

#include <stddef.h>
#include <stdint.h>

#include "transfer_function.h"

typedef struct trip_interval {
    float lo, hi; /* both belong to it; finite */
} trip_interval;

typedef struct trip_envelope {
    trip_interval *intervals;
    size_t count;
} trip_envelope;

/* A zeroed envelope holds nothing. Each of these adds to it. */
int trip_envelope_add_range(trip_envelope *e, double lo, double hi);
/* Exactly the values v with trip_tf_evaluate(tf, v).opacity > 0; tf is in data units. */
int trip_envelope_add_tf(trip_envelope *e, const trip_tf *tf);
/* Every finite value. */
int trip_envelope_add_all(trip_envelope *e);
void trip_envelope_destroy(trip_envelope *e);

/* False for every value that is not finite. */
bool trip_envelope_keeps(const trip_envelope *e, float value);
/* keep[i] = 1 where value i belongs to the envelope, else 0. */
void trip_envelope_keep_row(const trip_envelope *e, const float *values, size_t count,
                            uint8_t *keep);

#endif
