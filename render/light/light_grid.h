/* Numbers at the nodes of a coarse lattice over a volume. Node i along an axis lies at voxel index
 * i * spacing, or at that position if spacing is uneven (coordinates.h). Nodes reach from the first
 * voxel to the last one or just beyond. Values are interpolated linearly between nodes, and
 * constant beyond them. Plain values; read-only once filled, for any number of threads. */
#ifndef TRIP_LIGHT_GRID_H
#define TRIP_LIGHT_GRID_H

#include <stddef.h>
#include <stdint.h>

#include "geometry.h"

typedef struct trip_light_grid {
    double spacing; /* voxels, whole */
    int nodes[3];   /* along i, j, k: 2 or more */
    float *at;      /* i fastest */
} trip_light_grid;

/* Returns a lattice without values over `dims` voxels. It has at most `cells` cells along the
 * longest axis; then `stride` cells become one. */
static inline trip_light_grid trip_light_grid_over(const uint64_t dims[3], int cells, int stride)
{
    uint64_t longest = 1;
    for (int a = 0; a < 3; a++)
        longest = dims[a] - 1 > longest ? dims[a] - 1 : longest;
    uint64_t spacing = (longest + (uint64_t)cells - 1) / (uint64_t)cells * (uint64_t)stride;
    trip_light_grid g = { .spacing = (double)spacing };
    for (int a = 0; a < 3; a++) {
        g.nodes[a] = (int)((dims[a] - 1 + spacing - 1) / spacing) + 1;
        g.nodes[a] = g.nodes[a] < 2 ? 2 : g.nodes[a];
    }
    return g;
}

static inline size_t trip_light_grid_count(const trip_light_grid *g)
{
    return (size_t)g->nodes[0] * (size_t)g->nodes[1] * (size_t)g->nodes[2];
}

/* Interpolates at a position in units of nodes. */
double trip_light_grid_at_node(const trip_light_grid *g, const double node[3]);
/* Interpolates at a point in index space. */
double trip_light_grid_at(const trip_light_grid *g, trip_vec3 voxel);

#endif
