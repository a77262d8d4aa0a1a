/* Makes the coarse Gaussians of a scene's octree. Gaussians come in the octree's order, twice. The
 * first pass counts: a node of the octree is kept if its voxels hold few enough Gaussians. The
 * second pass merges the Gaussians of each voxel of a kept node (gaussian_moments.h).
 *
 * A node has 2^k voxels along each side, with the largest k that leaves at most half of the
 * Gaussians, and at most TRIP_LEVEL_RECORDS_MAX. A Gaussian with a deviation above 3/4 of a voxel
 * is not merged. The node holds it unchanged. One thread finds the voxels. Meanwhile the workers
 * find the moments of the next Gaussians, and merge the voxels that were closed before. */
#ifndef TRIP_GAUSSIAN_LEVELS_H
#define TRIP_GAUSSIAN_LEVELS_H

#include "gaussian_moments.h"
#include "gaussian_octree.h"
#include "workers.h"

enum { TRIP_LEVEL_RECORDS_MAX = 1 << 16, TRIP_LEVEL_HALVINGS = 8 };

typedef struct trip_gaussian_levels trip_gaussian_levels;

typedef struct trip_gaussian_levels_params {
    const trip_octree *octree;
    int degree;
    trip_workers *workers; /* no other loop runs during the second pass */
    /* Receives the coarse Gaussians of the second pass. */
    int (*emit)(void *user, uint64_t node, const trip_gaussian *g);
    void *user;
} trip_gaussian_levels_params;

/* Returns false if the budget is too small. */
bool trip_gaussian_levels_begin(trip_gaussian_levels **out,
                                const trip_gaussian_levels_params *params, trip_budget *budget);
/* Counts the next Gaussian of the first pass. */
int trip_gaussian_levels_count(trip_gaussian_levels *l, const trip_gaussian *g);
/* Ends the first pass and selects the nodes. Returns false if the budget is too small. */
bool trip_gaussian_levels_select(trip_gaussian_levels *l);
/* Merges the next Gaussians of the second pass. They are `stride` bytes apart and have only the
 * coefficients up to the degree. */
int trip_gaussian_levels_merge(trip_gaussian_levels *l, const unsigned char *splats, size_t stride,
                               size_t count);
/* Ends the second pass. */
int trip_gaussian_levels_end(trip_gaussian_levels *l);

/* These belong to the time after the first pass. */
uint64_t trip_gaussian_levels_records(const trip_gaussian_levels *l, uint64_t node);
/* Returns the width of a node's voxels; 0 for a leaf. */
double trip_gaussian_levels_width(const trip_gaussian_levels *l, uint64_t node);
/* Returns the number of coarse Gaussians. */
uint64_t trip_gaussian_levels_coarse(const trip_gaussian_levels *l);

void trip_gaussian_levels_free(trip_gaussian_levels *l);

#endif
