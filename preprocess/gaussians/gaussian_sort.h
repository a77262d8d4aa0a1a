/* External sort of Gaussian splats: by group, then coordinate, then number. The caller tells group
 * and coordinate of each splat. The workers sort runs that fit into memory together and spill them.
 * One thread merges them. The order does not depend on the memory or the number of workers. */
#ifndef TRIP_GAUSSIAN_SORT_H
#define TRIP_GAUSSIAN_SORT_H

#include "gaussian.h"
#include "output.h"
#include "workers.h"

/* Begins each spilled splat. A trip_gaussian with the coefficients up to the degree follows. */
typedef struct trip_spilled {
    uint64_t number; /* in the spool, in ascending order */
    uint64_t group;
    double at;
} trip_spilled;

/* Returns the bytes of a spilled splat, a multiple of 8. */
size_t trip_spilled_bytes(int degree);

typedef struct trip_gaussian_sort_params {
    const trip_output *spool; /* the splats, flushed */
    trip_output *closes;      /* the spool, if it is closed before the first emit; or NULL */
    trip_workers *workers;    /* no loop runs */
    uint64_t first;           /* splat of the spool that is sorted */
    uint64_t records;
    int degree;
    size_t bytes;       /* of a spilled splat, a multiple of 8; 0: trip_spilled_bytes(degree) */
    const char *folder; /* for temporary files */
    const char *path;   /* of the data set, for messages */
    /* Sets group and coordinate. It is called once for each splat, before the first emit. Workers
     * call it. */
    void (*place)(void *user, const trip_gaussian *splat, trip_spilled *head);
    /* Counts splats of a group. The counts add up to all splats before the first emit. Workers call
     * it. May be NULL. */
    void (*count)(void *user, uint64_t group, uint64_t splats);
    /* Receives the splats in order. */
    int (*emit)(void *user, const unsigned char *spilled);
    void *user;
} trip_gaussian_sort_params;

int trip_gaussian_sort(const trip_gaussian_sort_params *params, trip_budget *budget);

#endif
