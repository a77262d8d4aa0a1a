/* Computes the transmittance towards a light at the nodes of a lattice, from a lattice of
 * extinction. Sweeps run over the layers of nodes, beginning where light enters. Columns follow the
 * light's rays from layer to layer and hold the remaining light, so that nothing blurs. At each
 * layer, the nodes interpolate linearly between the columns around them.
 *
 * A directional light needs one sweep. Around a point light the nodes fall into six regions. The
 * region of a node is the axis and direction in which it is farthest from the light. Each region
 * has one sweep, outward from the light, with columns that spread. One thread calls. Other threads
 * may do rows of a layer as independent tasks; the results have the same bits. */
#ifndef TRIP_LIGHT_SWEEP_H
#define TRIP_LIGHT_SWEEP_H

#include <stdbool.h>

#include "budget.h"
#include "light_grid.h"
#include "task_runner.h"

typedef struct trip_light_sweep {
    const trip_light_grid *extinction; /* per world unit */
    trip_light_grid *out;              /* transmittances are added to it, times `weight` */
    double weight;
    /* Length over which all but 1/e of the lost light returns, in world units; 0: none returns.
     * Directional lights only. */
    double range;
    int parts; /* of a step, for lattices of extinction with smaller cells; 0 means 1 */
    /* A byte for each cell of `out`, like nodes but one fewer along each axis. It is not 0 if this
     * cell and those around it have no extinction. NULL: unknown. */
    const unsigned char *clear;
    double last[3]; /* last voxel: only [0, last] attenuates */
    const trip_affine *index_to_world;

    /* Axes of layers, rows and columns. Layers descend if the light comes from above. */
    int axis, across, down;
    bool descending;
    bool point;
    double light[3]; /* position of a point light, in nodes */
    /* A column at w across or down on the last layer moves by slope + spread w per layer, in nodes.
     */
    double slope[2], spread;
    double length;            /* world length of a step of a directional light */
    double per_voxel;         /* cells of `out` */
    double kept;              /* share of the lost light that stays lost over a step */
    int columns[2], first[2]; /* number of columns, one node apart; w of the first column */
    int start;                /* the first layer that the light meets */
    double before;            /* distance from a point light to the first layer, in layers */
    int layer;                /* next layer */
    bool attenuated;          /* the columns are done; the nodes are in progress */
    int rows[2];              /* rows of a step: from, to below */
    int nodes[2][2];          /* the region's nodes in the layer: from, to below */
    double *through;          /* NULL if the region has no nodes */
    trip_budget *budget;
} trip_light_sweep;

/* Begins the sweep of a directional light. `to_light` is in index space and not zero. Returns false
 * if the columns exceed the budget. */
bool trip_light_sweep_begin(trip_light_sweep *s, trip_vec3 to_light, trip_budget *budget);
/* Begins the sweep of one region around a point light at a position in index space. */
#define TRIP_LIGHT_REGIONS 6
bool trip_light_sweep_begin_at(trip_light_sweep *s, trip_vec3 light, int region,
                               trip_budget *budget);
/* Does some rows of a layer. Returns false once all are done. With `runner` NULL the caller's
 * thread does them. */
bool trip_light_sweep_step(trip_light_sweep *s, const trip_task_runner *runner);
void trip_light_sweep_end(trip_light_sweep *s);
/* Returns the maximum size of the columns for any light, in bytes. */
size_t trip_light_sweep_max_bytes(const trip_light_grid *out);

#endif
