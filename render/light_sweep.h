/* Transmittance towards a light, at the nodes of a lattice, from a lattice of extinction: sweeps
 * over the layers of nodes, from where light enters on. What is left of the light is kept along
 * columns that follow its rays from layer to layer, so that nothing blurs on the way; at each layer
 * the nodes take theirs from the columns around them, linearly. A light in a direction takes one
 * sweep. About a light at a place the nodes fall into six regions, by the axis that the way to them
 * is longest along and its sign, as the lists of a view do; each has a sweep, outward from the
 * light, with columns that spread. One thread calls; rows of a layer are independent tasks, which
 * others may do: the numbers are the same bits. */
#ifndef TRIP_LIGHT_SWEEP_H
#define TRIP_LIGHT_SWEEP_H

#include <stdbool.h>

#include "budget.h"
#include "light_grid.h"
#include "task_runner.h"

typedef struct trip_light_sweep {
    const trip_light_grid *extinction; /* per world unit */
    trip_light_grid *out;              /* transmittances are added to it, times: */
    double weight;
    double last[3]; /* voxels: light passes extinction in [0, last] alone */
    const trip_affine *index_to_world;

    /* Axes of layers, rows and columns; layers go down where the light comes from above. */
    int axis, across, down;
    bool descending;
    bool point;
    double light[3]; /* of a light at a place, where: nodes */
    /* A column that is at w across, or down, at the last layer, moves by slope + spread w from each
     * layer to the next, in nodes. */
    double slope[2], spread;
    double length;            /* of a step in the world, of a light in a direction */
    int columns[2], first[2]; /* w of the first, and how many one node apart */
    int start;                /* the layer that the light comes to first */
    double before;            /* and layers that it passes before that */
    int layer;                /* the next */
    bool attenuated;          /* its columns are done, its nodes are being done */
    int rows[2];              /* of columns or nodes, those of a step: from, and to below */
    int nodes[2][2];          /* of the layer, the region's: from, and to below */
    double *through;          /* NULL: the region has no nodes */
    trip_budget *budget;
} trip_light_sweep;

/* A light in a direction: `to_light` is in index space, not zero; the rest as above. False where
 * the columns' memory is refused. */
bool trip_light_sweep_begin(trip_light_sweep *s, trip_vec3 to_light, trip_budget *budget);
/* A light at a place of index space, and one of the regions about it. */
#define TRIP_LIGHT_REGIONS 6
bool trip_light_sweep_begin_at(trip_light_sweep *s, trip_vec3 light, int region,
                               trip_budget *budget);
/* Some rows of a layer; false once all are done. `runner` NULL: the caller's thread does them. */
bool trip_light_sweep_step(trip_light_sweep *s, const trip_task_runner *runner);
void trip_light_sweep_end(trip_light_sweep *s);
/* The most that the columns of any light take. */
size_t trip_light_sweep_max_bytes(const trip_light_grid *out);

#endif
