/* The emission-absorption integral of normal densities along one ray (gaussian_integral.h). Pure
 * functions of their arguments. Any thread. */
#ifndef TRIP_GAUSSIAN_RAY_H
#define TRIP_GAUSSIAN_RAY_H

#include <stddef.h>
#include <stdint.h>

#include "key_sort.h"

/* A density reaches so many deviations from its mean. 4e-8 of it lies beyond. */
#define TRIP_NORMAL_REACH 5.5

enum { TRIP_NORMAL_STEPS = 32, TRIP_NORMAL_CELLS = 352 }; /* in a deviation; on both sides */

/* The integral of the normal density and the density itself, at multiples of 1 / TRIP_NORMAL_STEPS
 * from -TRIP_NORMAL_REACH on. */
typedef struct trip_normal_table {
    double at[TRIP_NORMAL_CELLS + 1][2];
} trip_normal_table;

void trip_normal_table_make(trip_normal_table *t);

/* Returns the normal density's integral from minus infinity to x, within 1e-8. */
double trip_normal_integral(const trip_normal_table *t, double x);

/* A density along a ray. */
typedef struct trip_ray_part {
    double mean, deviation, tau;
    double rgb[3];
} trip_ray_part;

/* Memory for rays of at most `room` parts. */
typedef struct trip_ray_scratch {
    trip_ray_part *parts, *sorted;
    double *means;
    trip_key *keys, *key_scratch;
    uint32_t *active;
    size_t room;
} trip_ray_scratch;

/* Returns the bytes of memory for a number of parts, and divides such memory. */
size_t trip_ray_scratch_bytes(size_t room);
trip_ray_scratch trip_ray_scratch_in(void *memory, size_t room);

/* Integrates s->parts[0 .. count - 1]. Densities at depths below `from` count as if they were at
 * `from`. Writes premultiplied colour and opacity. */
void trip_ray_integrate(const trip_normal_table *t, trip_ray_scratch *s, size_t count, double from,
                        double tolerance, double rgba[4]);

#endif
