/* The transfer function between the codes of its table: linear from one entry to the next, colour
 * and extinction alike, and beyond the ends as at them. Read-only once made. */
#ifndef TRIP_CLASSES_H
#define TRIP_CLASSES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "transfer_function.h"

enum { TRIP_CLASS_CODES = 65536 };

typedef struct trip_classes {
    const trip_tf_entry *table;
    /* The first code from here on with extinction; TRIP_CLASS_CODES: none. */
    uint32_t next_visible[TRIP_CLASS_CODES];
    /* Codes between which each component is close to a line: so finely a function has to be looked
     * at for nothing of it to be missed. */
    uint16_t knots[TRIP_CLASS_CODES];
    uint16_t knots_up_to[TRIP_CLASS_CODES]; /* how many are at most so much */
    size_t knot_count;
} trip_classes;

/* `table` outlives it. Between knots the depth of a voxel's length is within KNOT_TOLERANCE times
 * `tolerance` of a line, or where it is more than 1 within so much of itself; colours, which count
 * by the opacity there, are as close at depths above 1, below so much less as the depth is. */
void trip_classes_make(trip_classes *c, const trip_tf_entry *table, double voxel_world,
                       double tolerance);

/* False only when no code from `least` to `most` has extinction. */
bool trip_classes_visible(const trip_classes *c, double min, double max);
/* The first knot above a code, and the first that is not below it: its place, or knot_count. */
size_t trip_classes_knot_above(const trip_classes *c, double code);
size_t trip_classes_knot_from(const trip_classes *c, double code);
/* Extinction per world unit, and colour. */
double trip_classes_at(const trip_classes *c, double code, double rgb[3]);

#endif
