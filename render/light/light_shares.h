/* The shares of voxels at the nodes of a lattice (light_grid.h), along one axis. They are needed if
 * spacing is uneven (coordinates.h), because the lattice then lies over positions. Values are
 * linear between voxels. They are sampled at the voxels and at points between them, at most a mean
 * spacing apart. The weight of a sample is the length of the axis around it. Each sample counts at
 * the two nodes around it in proportion to its nearness. So every node has a share of some voxel,
 * however far apart voxels are. With even steps each voxel has weight 1. One thread owns it. */
#ifndef TRIP_LIGHT_SHARES_H
#define TRIP_LIGHT_SHARES_H

#include "budget.h"
#include "coordinates.h"

typedef struct trip_light_shares {
    int64_t voxels;
    int nodes;
    int32_t *first; /* by voxel: the first node with a share */
    size_t *begin;  /* by voxel, plus the end: index of its first share, one per node */
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
