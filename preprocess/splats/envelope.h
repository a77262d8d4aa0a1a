/* The opacity envelope: the set of values that become splats. It is the union of value ranges and
 * of all values with opacity above 0 in a transfer function. It is exact for float32 values, as
 * closed, disjoint, ascending intervals. One thread builds it; then any thread may read it. */
#ifndef TRIP_ENVELOPE_H
#define TRIP_ENVELOPE_H

#include <stddef.h>
#include <stdint.h>

#include "transfer_function.h"

typedef struct trip_interval {
    float lo, hi; /* inclusive, finite */
} trip_interval;

typedef struct trip_envelope {
    trip_interval *intervals;
    size_t count;
} trip_envelope;

/* A zeroed envelope is empty. The trip_envelope_add_*() functions add values and report failures.
 */
int trip_envelope_add_range(trip_envelope *e, double lo, double hi);
/* Adds exactly the values v with trip_tf_evaluate(tf, v).opacity > 0; tf is in data units. */
int trip_envelope_add_tf(trip_envelope *e, const trip_tf *tf);
/* Adds every finite value. */
int trip_envelope_add_all(trip_envelope *e);
void trip_envelope_destroy(trip_envelope *e);

/* Returns whether the envelope contains a value; false for values that are not finite. */
bool trip_envelope_keeps(const trip_envelope *e, float value);
/* Sets keep[i] to 1 if value i is in the envelope, else 0. */
void trip_envelope_keep_row(const trip_envelope *e, const float *values, size_t count,
                            uint8_t *keep);

#endif
