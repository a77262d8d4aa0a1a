/* External sort of Gaussian splats: by leaf of the division, then coordinate along an axis, then
 * number. Runs that fit into memory are sorted and spilled, and then merged. The order does not
 * depend on the memory. One thread. */
#ifndef TRIP_GAUSSIAN_SORT_H
#define TRIP_GAUSSIAN_SORT_H

#include "gaussian.h"
#include "gaussian_tree.h"
#include "output.h"

/* Begins each spilled splat. A trip_gaussian with the coefficients up to the degree follows. */
typedef struct trip_spilled {
    uint64_t number; /* in the file */
    uint64_t leaf;
} trip_spilled;

/* Returns the bytes of a spilled splat, a multiple of 8. */
size_t trip_spilled_bytes(int degree);

typedef struct trip_gaussian_sort_params {
    const trip_output *spool; /* the splats by number, flushed; `leaf` is ignored */
    uint64_t records;
    int degree, axis;
    trip_gaussian_tree *tree; /* its leaves get their numbers of records before the first emit */
    const char *folder;       /* for temporary files */
    const char *path;         /* of the data set, for messages */
    /* Receives the splats in order. */
    int (*emit)(void *user, const unsigned char *spilled);
    void *user;
} trip_gaussian_sort_params;

int trip_gaussian_sort(const trip_gaussian_sort_params *params, trip_budget *budget);

#endif
