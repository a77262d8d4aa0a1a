#include "point_fields.h"

#include <stdbool.h>
#include <stddef.h>
#include <strings.h>

static const struct {
    const char *name;
    trip_point_field field;
} names[] = {
    { "x", TRIP_FIELD_X },
    { "y", TRIP_FIELD_Y },
    { "z", TRIP_FIELD_Z },
    { "nx", TRIP_FIELD_NX },
    { "ny", TRIP_FIELD_NY },
    { "nz", TRIP_FIELD_NZ },
    { "normal_x", TRIP_FIELD_NX },
    { "normal_y", TRIP_FIELD_NY },
    { "normal_z", TRIP_FIELD_NZ },
    { "r", TRIP_FIELD_RED },
    { "g", TRIP_FIELD_GREEN },
    { "b", TRIP_FIELD_BLUE },
    { "red", TRIP_FIELD_RED },
    { "green", TRIP_FIELD_GREEN },
    { "blue", TRIP_FIELD_BLUE },
    { "diffuse_red", TRIP_FIELD_RED },
    { "diffuse_green", TRIP_FIELD_GREEN },
    { "diffuse_blue", TRIP_FIELD_BLUE },
    { "radius", TRIP_FIELD_RADIUS },
    { "pscale", TRIP_FIELD_RADIUS },
    { "point_radius", TRIP_FIELD_RADIUS },
    { "i", TRIP_FIELD_INTENSITY },
    { "intensity", TRIP_FIELD_INTENSITY },
    { "reflectance", TRIP_FIELD_INTENSITY },
    { "classification", TRIP_FIELD_CLASSIFICATION },
    { "class", TRIP_FIELD_CLASSIFICATION },
    { "return_number", TRIP_FIELD_RETURN_NUMBER },
    { "returnnumber", TRIP_FIELD_RETURN_NUMBER },
    { "number_of_returns", TRIP_FIELD_RETURNS },
    { "numberofreturns", TRIP_FIELD_RETURNS },
    { "num_returns", TRIP_FIELD_RETURNS },
    { "gps_time", TRIP_FIELD_TIME },
    { "gpstime", TRIP_FIELD_TIME },
    { "timestamp", TRIP_FIELD_TIME },
};

trip_point_field trip_point_field_of(const char *name)
{
    if (strncasecmp(name, "scalar_", 7) == 0)
        name += 7;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcasecmp(name, names[i].name) == 0)
            return names[i].field;
    return TRIP_FIELDS;
}

static bool holds(unsigned fields, trip_point_field first, unsigned count)
{
    const unsigned wanted = ((1u << count) - 1) << first;
    return (fields & wanted) == wanted;
}

unsigned trip_point_attributes_of(unsigned fields)
{
    const bool returns =
        holds(fields, TRIP_FIELD_RETURNS, 1) || holds(fields, TRIP_FIELD_RETURN_NUMBER, 1);
    return (holds(fields, TRIP_FIELD_NX, 3) ? TRIP_POINT_NORMAL : 0) |
           (holds(fields, TRIP_FIELD_RED, 3) ? TRIP_POINT_COLOUR : 0) |
           (holds(fields, TRIP_FIELD_RADIUS, 1) ? TRIP_POINT_RADIUS : 0) |
           (holds(fields, TRIP_FIELD_INTENSITY, 1) ? TRIP_POINT_INTENSITY : 0) |
           (holds(fields, TRIP_FIELD_CLASSIFICATION, 1) ? TRIP_POINT_CLASSIFICATION : 0) |
           (returns ? TRIP_POINT_RETURNS : 0) |
           (holds(fields, TRIP_FIELD_TIME, 1) ? TRIP_POINT_TIME : 0);
}

static uint8_t byte_of(double v)
{
    return v >= 0 && v < 256 ? (uint8_t)v : 0;
}

void trip_point_set(trip_point *p, trip_point_field field, double value)
{
    switch (field) {
    case TRIP_FIELD_X:
    case TRIP_FIELD_Y:
    case TRIP_FIELD_Z:
        p->position[field - TRIP_FIELD_X] = value;
        break;
    case TRIP_FIELD_NX:
    case TRIP_FIELD_NY:
    case TRIP_FIELD_NZ:
        p->normal[field - TRIP_FIELD_NX] = (float)value;
        break;
    case TRIP_FIELD_RED:
    case TRIP_FIELD_GREEN:
    case TRIP_FIELD_BLUE:
        p->colour[field - TRIP_FIELD_RED] = (float)value;
        break;
    case TRIP_FIELD_RADIUS:
        p->radius = (float)value;
        break;
    case TRIP_FIELD_INTENSITY:
        p->intensity = (float)value;
        break;
    case TRIP_FIELD_CLASSIFICATION:
        p->classification = byte_of(value);
        break;
    case TRIP_FIELD_RETURN_NUMBER:
        p->return_number = byte_of(value);
        break;
    case TRIP_FIELD_RETURNS:
        p->returns = byte_of(value);
        break;
    case TRIP_FIELD_TIME:
        p->gps_time = value;
        break;
    default:
        break;
    }
}
