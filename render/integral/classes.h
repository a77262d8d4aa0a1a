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
    /* Codes between which no component is farther from a line than a thousandth of its greatest
     * value in the table: so finely a function has to be looked at for nothing of it to be missed.
     */
    uint32_t knots[TRIP_CLASS_CODES];
    size_t knot_count;
} trip_classes;

/* `table` outlives it. */
void trip_classes_make(trip_classes *c, const trip_tf_entry *table);

/* False only when no code from `least` to `most` has extinction. */
bool trip_classes_visible(const trip_classes *c, double least, double most);
/* The first knot above a code: its place, or knot_count. */
size_t trip_classes_knot_above(const trip_classes *c, double code);
/* Extinction per world unit, and colour. */
double trip_classes_at(const trip_classes *c, double code, double rgb[3]);

#endif
