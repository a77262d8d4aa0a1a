/* Maps the grid of a list to the grid of level 0, which defines weights and the order of sheets.
 * Voxel i along an axis lies at scale * i + offset. Plain values. */
#ifndef TRIP_LIST_GRID_H
#define TRIP_LIST_GRID_H

#include "dataset.h"

typedef struct trip_list_grid {
    double scale[3], offset[3]; /* exactly 1 and 0 for level 0 */
} trip_list_grid;

/* Makes the map of a list. Fails, reported, if the list cannot be merged with others: its grid is
 * not parallel to level 0, or its sheets are not at the list's coordinates. */
int trip_list_grid_make(trip_list_grid *g, const trip_dataset *data, const trip_list *list);

/* Converts a difference of positions from the list's grid to level 0. */
static inline trip_vec3 trip_list_grid_vector(const trip_list_grid *g, trip_vec3 v)
{
    return trip_v3(v.x * g->scale[0], v.y * g->scale[1], v.z * g->scale[2]);
}

/* Converts a position from the list's grid to level 0. */
static inline trip_vec3 trip_list_grid_point(const trip_list_grid *g, trip_vec3 p)
{
    return trip_v3(p.x * g->scale[0] + g->offset[0], p.y * g->scale[1] + g->offset[1],
                   p.z * g->scale[2] + g->offset[2]);
}

/* Returns the maximum growth of a length from the list's grid to level 0. */
static inline double trip_list_grid_growth(const trip_list_grid *g)
{
    return fmax(g->scale[0], fmax(g->scale[1], g->scale[2]));
}

#endif
