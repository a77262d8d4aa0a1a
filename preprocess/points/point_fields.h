/* Names of the attributes of points in formats with named columns: PLY, PCD, text, OpenVDB. Any
 * thread. */
#ifndef TRIP_POINT_FIELDS_H
#define TRIP_POINT_FIELDS_H

#include "point.h"

typedef enum trip_point_field {
    TRIP_FIELD_X,
    TRIP_FIELD_Y,
    TRIP_FIELD_Z,
    TRIP_FIELD_NX,
    TRIP_FIELD_NY,
    TRIP_FIELD_NZ,
    TRIP_FIELD_RED,
    TRIP_FIELD_GREEN,
    TRIP_FIELD_BLUE,
    TRIP_FIELD_RADIUS,
    TRIP_FIELD_INTENSITY,
    TRIP_FIELD_CLASSIFICATION,
    TRIP_FIELD_RETURN_NUMBER,
    TRIP_FIELD_RETURNS,
    TRIP_FIELD_TIME,
    TRIP_FIELDS
} trip_point_field;

/* Returns the field of a name, in any case, also behind "scalar_"; TRIP_FIELDS for other names. */
trip_point_field trip_point_field_of(const char *name);

/* Returns the attributes of a set of fields. Bit i of the set is field i. Normals and colours need
 * all three. */
unsigned trip_point_attributes_of(unsigned fields);

/* Stores a value. Colours keep the range of the file. */
void trip_point_set(trip_point *p, trip_point_field field, double value);

#endif
