/* The shares of voxels at the nodes of a lattice (light_grid.h), along one axis with uneven spacing
 * (coordinates.h), where the lattice lies over positions. Values are linear between voxels. They
 * are sampled at the voxels and at points between, at most a mean spacing apart. Each sample has
 * the weight of its surroundings, and counts at the two nodes around it in proportion to its
 * nearness. Every node so has a share of some voxel, however far apart voxels are. With even steps
 * each voxel has weight 1. One thread owns it. */
#ifndef TRIP_LIGHT_SHARES_H
#define TRIP_LIGHT_SHARES_H

#include "budget.h"
#include "coordinates.h"

typedef struct trip_light_shares {
    int64_t voxels;
    int nodes;
    int32_t *first; /* by voxel: the first node with a share */
    size_t *begin;  /* by voxel, plus one: index of its shares, one per node from first on */
    double *shares;
    double *sums; /* by node: sum over all voxels */
} trip_light_shares;

/* Makes the shares for nodes `spacing` (1 or more) apart, from position 0 to at least the last
 * voxel. Returns false, with nothing allocated, if it exceeds the budget. */
bool trip_light_shares_make(trip_light_shares *s, const trip_coordinates *c, int axis,
                            double spacing, int nodes, trip_budget *budget);
/* Frees shares that were made or are zero. */
void trip_light_shares_destroy(trip_light_shares *s, trip_budget *budget);

#endif
