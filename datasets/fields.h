/* Volumes of any size with known values, for tests and benchmarks. Each is a field in closed form
 * over the cube [-1, 1]^3 with values in [0, 1]; values and gradients are exact. Pure functions. */
#ifndef TRIP_FIELDS_H
#define TRIP_FIELDS_H

#include "geometry.h"

/* `detail` scales the fineness of the structure. 1 suits a cube of about 256 voxels. */
typedef double trip_field_function(trip_vec3 p, double detail, trip_vec3 *gradient);

typedef struct trip_field {
    const char *name;
    const char *stage;
    trip_field_function *sample; /* the gradient is per unit of p; it may be NULL */
} trip_field;

/* The last entry has the name NULL. */
extern const trip_field trip_fields[];

const trip_field *trip_field_find(const char *name);

#endif
