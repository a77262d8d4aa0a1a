/* External sort of Gaussian splats: by group, then coordinate, then number. The caller tells group
 * and coordinate of each splat. Runs that fit into memory are sorted and spilled, and then merged.
 * The order does not depend on the memory. One thread. */
#ifndef TRIP_GAUSSIAN_SORT_H
#define TRIP_GAUSSIAN_SORT_H

#include "gaussian.h"
#include "output.h"

/* Begins each spilled splat. A trip_gaussian with the coefficients up to the degree follows. */
typedef struct trip_spilled {
    uint64_t number; /* in the file; coarse splats have higher ones */
    uint64_t group;
    double at;
} trip_spilled;

/* Returns the bytes of a spilled splat, a multiple of 8. */
size_t trip_spilled_bytes(int degree);

typedef struct trip_gaussian_sort_params {
    const trip_output *spool; /* the splats, flushed */
    uint64_t records;
    int degree;
    const char *folder; /* for temporary files */
    const char *path;   /* of the data set, for messages */
    /* Sets group and coordinate. It is called once for each splat, before the first emit. */
    void (*place)(void *user, const trip_gaussian *splat, trip_spilled *head);
    /* Receives the splats in order. */
    int (*emit)(void *user, const unsigned char *spilled);
    void *user;
} trip_gaussian_sort_params;

int trip_gaussian_sort(const trip_gaussian_sort_params *params, trip_budget *budget);

#endif
