/* Chooses the encoding of values and normals. One thread. */
#ifndef TRIP_BRICK_CODES_H
#define TRIP_BRICK_CODES_H

#include "brick_input.h"
#include "normal.h"
#include "writer.h"

typedef struct trip_brick_codes {
    /* Its knots are the member below, so the struct must not move. */
    trip_quantiser quantiser;
    trip_knots knots;
    const double *ids; /* the table of ids, or NULL */
    uint32_t id_count;
    unsigned code_bytes, normal_bytes; /* as in the header; normal_bytes 0 means no normals */
    trip_compact_normals compact;      /* encoding of 3-byte normals */
} trip_brick_codes;

/* Chooses the encoding of the input's values and normals, after the scan if there is one.
 * - Types of 8 or 16 bits without rounding: even codes over the range of the type.
 * - Ids: a code for each id.
 * - Other types: as trip_brick_codes_set_range() after a scan, or the caller calls it before
 *   quantising.
 *
 * There are codes below and above the values, except for 16-bit integers and ids. */
int trip_brick_codes_choose(trip_brick_codes *c, const trip_brick_input *in);
/* Sets the codes to cover the range of the input's tally. The codes are even if that leaves enough
 * for the kept values wherever they are dense. Otherwise they follow the values. They also cover
 * the background of a sparse volume if it is near the values. */
int trip_brick_codes_set_range(trip_brick_codes *c, const trip_brick_input *in);
/* Returns the codes as a data set has them. */
trip_codes trip_brick_codes_get(const trip_brick_codes *c);

/* Fills the header's fields for codes and normals. */
trip_writer_codes trip_brick_codes_header(const trip_brick_codes *c);

#endif
