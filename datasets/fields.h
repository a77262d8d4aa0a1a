/* Volumes of any size with known values: closed-form fields over the cube [-1, 1]^3, value in [0,
 * 1] and gradient both exact, for tests, benchmarks and trying things out. Pure functions. */
#ifndef TRIP_FIELDS_H
#define TRIP_FIELDS_H

#include "geometry.h"

/* `detail` scales how fine the structure is: 1 suits a cube of about 256 voxels. */
typedef double trip_field_function(trip_vec3 p, double detail, trip_vec3 *gradient);

typedef struct trip_field {
    const char *name;
    const char *stage;
    trip_field_function *sample; /* gradient per unit of p; may be NULL */
} trip_field;

/* Ends with a NULL name. */
extern const trip_field trip_fields[];

const trip_field *trip_field_find(const char *name);

#endif
