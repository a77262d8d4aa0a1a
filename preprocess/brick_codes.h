/* How `brick` encodes values and normals. One thread. */
#ifndef TRIP_BRICK_CODES_H
#define TRIP_BRICK_CODES_H

#include "brick_input.h"
#include "normal.h"
#include "writer.h"

typedef struct trip_brick_codes {
    trip_quantiser quantiser;
    unsigned code_bytes, normal_bytes; /* as the header has them; normal_bytes 0: no normals */
    trip_compact_normals compact;      /* the meaning of normals of 3 bytes */
} trip_brick_codes;

/* Chooses how to encode the values and normals of the input, after the scan if there is one. Codes
 * cover the range of types of 8 or 16 bits that are not rounded, else the range of the values, if
 * that was scanned; else it is to be set before values are quantised. There are codes below and
 * above those of values of 8 bits, and of numbers that are no integers of 16. */
void trip_brick_codes_choose(trip_brick_codes *c, const trip_brick_input *in);
/* Codes cover [lo, hi], the values, and the background of a sparse volume where that is not much
 * farther off than values are apart. */
void trip_brick_codes_set_range(trip_brick_codes *c, const trip_brick_input *in, double lo,
                                double hi);

/* What the header of the data set says of codes and normals. */
trip_writer_codes trip_brick_codes_header(const trip_brick_codes *c);

#endif
