/* Chooses the encoding of values and normals. One thread. */
#ifndef TRIP_BRICK_CODES_H
#define TRIP_BRICK_CODES_H

#include "brick_input.h"
#include "normal.h"
#include "writer.h"

typedef struct trip_brick_codes {
    trip_quantiser quantiser;
    unsigned code_bytes, normal_bytes; /* as in the header; normal_bytes 0 means no normals */
    trip_compact_normals compact;      /* encoding of 3-byte normals */
} trip_brick_codes;

/* Chooses the encoding of the input's values and normals, after the scan if there is one.
 * - Types of 8 or 16 bits without rounding: codes cover the range of the type.
 * - Other types: codes cover the scanned range, or the caller sets the range before quantising.
 * There are codes below and above the values, except for 16-bit integers. */
void trip_brick_codes_choose(trip_brick_codes *c, const trip_brick_input *in);
/* Sets the codes to cover [lo, hi]. The codes also cover the background of a sparse volume if it is
 * near the values. */
void trip_brick_codes_set_range(trip_brick_codes *c, const trip_brick_input *in, double lo,
                                double hi);

/* Fills the header's fields for codes and normals. */
trip_writer_codes trip_brick_codes_header(const trip_brick_codes *c);

#endif
