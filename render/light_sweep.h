/* Transmittance towards a direction, at all nodes of a lattice, from a lattice of extinction: one
 * sweep over the layers of nodes, from where light enters on. What is left of the light is kept
 * along columns that follow its rays from layer to layer, so that nothing blurs on the way; at each
 * layer the nodes take theirs from the columns around them, linearly. One thread calls; rows of a
 * layer are independent tasks, which others may do: the numbers are the same bits. */
#ifndef TRIP_LIGHT_SWEEP_H
#define TRIP_LIGHT_SWEEP_H

#include <stdbool.h>

#include "budget.h"
#include "light_grid.h"

/* Does `count` tasks on any threads, and returns when all are done. */
typedef struct trip_task_runner {
    void (*run)(void *user, void (*task)(void *context, unsigned number), void *context,
                unsigned count);
    void *user;
} trip_task_runner;

typedef struct trip_light_sweep {
    const trip_light_grid *extinction; /* per world unit */
    trip_light_grid *out;              /* transmittances are added to it, times: */
    double weight;
    double last[3]; /* voxels: light passes extinction in [0, last] alone */

    /* Axes of layers, rows and columns; layers go down where the light comes from above. */
    int axis, across, down;
    bool descending;
    double slope[2]; /* what a column moves by from layer to layer, in nodes: across, down */
    double length;   /* of that, in the world */
    int columns[2], first[2];
    int layer; /* the next, 0 where light enters */
    double *through;
    trip_budget *budget;
} trip_light_sweep;

/* `to_light` is in index space, not zero, `world_length` its length in the world; the rest as
 * above. False where the columns' memory is refused. */
bool trip_light_sweep_begin(trip_light_sweep *s, trip_vec3 to_light, double world_length,
                            trip_budget *budget);
/* One layer; false once all are done. `runner` NULL: the caller's thread does all of it. */
bool trip_light_sweep_step(trip_light_sweep *s, const trip_task_runner *runner);
void trip_light_sweep_end(trip_light_sweep *s);
/* The most that the columns of any direction take. */
size_t trip_light_sweep_most_bytes(const trip_light_grid *out);

#endif
