/* What voxels count at the nodes of a lattice (light_grid.h), along one axis of a grid with uneven
 * spacing (coordinates.h), where the lattice lies over places. Values are linear between voxels; of
 * them count those at the voxels and at points between, no more than a mean spacing apart, each for
 * as much as lies about it, at the two nodes around it in proportion to how near it is. So every
 * node has a share of something however far voxels are apart, and with even steps each voxel counts
 * for one. Owned by one thread. */
#ifndef TRIP_LIGHT_SHARES_H
#define TRIP_LIGHT_SHARES_H

#include "budget.h"
#include "coordinates.h"

typedef struct trip_light_shares {
    int64_t voxels;
    int nodes;
    int32_t *first; /* by voxel: the first node that it counts at */
    size_t *begin;  /* by voxel, and one more: its shares, one a node from there on */
    double *shares;
    double *sums; /* by node: of all voxels */
} trip_light_shares;

/* Of nodes `spacing` apart, 1 or more, the first at place 0, the last at or beyond the last voxel.
 * False (and nothing taken) where the budget refuses the memory. */
bool trip_light_shares_make(trip_light_shares *s, const trip_coordinates *c, int axis,
                            double spacing, int nodes, trip_budget *budget);
/* Of ones that were made, or zeroed. */
void trip_light_shares_destroy(trip_light_shares *s, trip_budget *budget);

#endif
