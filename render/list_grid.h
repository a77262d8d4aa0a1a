/* How the grid of a list lies in that of level 0, which weights and the order of sheets refer to:
 * voxel i along an axis lies at scale * i + offset. Plain values. */
#ifndef TRIP_LIST_GRID_H
#define TRIP_LIST_GRID_H

#include "dataset.h"

typedef struct trip_list_grid {
    double scale[3], offset[3]; /* exactly 1 and 0 where the list's map is that of level 0 */
} trip_list_grid;

/* Fails (reported) for grids that do not lie along that of level 0, or whose sheets do not lie
 * where the list says: their sheets could not be merged with those of other lists. */
int trip_list_grid_make(trip_list_grid *g, const trip_dataset *data, const trip_list *list);

/* A difference of positions in the list's grid, in that of level 0. */
static inline trip_vec3 trip_list_grid_vector(const trip_list_grid *g, trip_vec3 v)
{
    return trip_v3(v.x * g->scale[0], v.y * g->scale[1], v.z * g->scale[2]);
}

/* A position in the list's grid, in that of level 0. */
static inline trip_vec3 trip_list_grid_point(const trip_list_grid *g, trip_vec3 p)
{
    return trip_v3(p.x * g->scale[0] + g->offset[0], p.y * g->scale[1] + g->offset[1],
                   p.z * g->scale[2] + g->offset[2]);
}

/* The most that a length grows by from the list's grid to that of level 0. */
static inline double trip_list_grid_growth(const trip_list_grid *g)
{
    return fmax(g->scale[0], fmax(g->scale[1], g->scale[2]));
}

#endif
