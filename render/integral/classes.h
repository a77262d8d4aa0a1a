/* The transfer function between the codes of its table. Colour and extinction are linear from one
 * entry to the next, and constant beyond the ends. Read-only once made; any thread may use it. */
#ifndef TRIP_CLASSES_H
#define TRIP_CLASSES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "transfer_function.h"

enum { TRIP_CLASS_CODES = 65536 };

typedef struct trip_classes {
    const trip_tf_entry *table;
    /* The first code from here on with extinction, or TRIP_CLASS_CODES. */
    uint32_t next_visible[TRIP_CLASS_CODES];
    /* Codes that divide the table into ranges in which every component is close to a line. Samples
     * at this spacing miss no feature of the transfer function. */
    uint16_t knots[TRIP_CLASS_CODES];
    uint16_t knots_up_to[TRIP_CLASS_CODES]; /* number of knots up to each code */
    size_t knot_count;
} trip_classes;

/* Prepares `table`, which must outlive `c`. Let e be KNOT_TOLERANCE times `tolerance`, and depth
 * the optical depth of one voxel length at a code. Between knots the depth lies within e max(1,
 * depth) of a line. Colours count by the opacity and lie within e / min(1, depth) of a line. */
void trip_classes_make(trip_classes *c, const trip_tf_entry *table, double voxel_world,
                       double tolerance);

/* Returns false only if no code from `min` to `max` has extinction. */
bool trip_classes_visible(const trip_classes *c, double min, double max);
/* Return the index of the first knot above a code, and of the first knot at or above it. Both
 * return knot_count if there is none. */
size_t trip_classes_knot_above(const trip_classes *c, double code);
size_t trip_classes_knot_from(const trip_classes *c, double code);
/* Returns the extinction per world unit, and writes the colour. */
double trip_classes_at(const trip_classes *c, double code, double rgb[3]);

#endif
