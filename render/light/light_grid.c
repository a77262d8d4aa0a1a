#include "light_grid.h"

double trip_light_grid_at_node(const trip_light_grid *g, const double node[3])
{
    const size_t step[3] = { 1, (size_t)g->nodes[0], (size_t)g->nodes[0] * (size_t)g->nodes[1] };
    const float *from = g->at;
    double part[3];
    for (int a = 0; a < 3; a++) {
        double last = g->nodes[a] - 1, x = node[a] > 0 ? node[a] < last ? node[a] : last : 0;
        int cell = x < last ? (int)x : g->nodes[a] - 2;
        part[a] = x - cell;
        from += (size_t)cell * step[a];
    }
    double sum = 0;
    for (int n = 0; n < 8; n++) {
        size_t corner = (n & 1) * step[0] + (n >> 1 & 1) * step[1] + (size_t)(n >> 2) * step[2];
        double weight = (n & 1 ? part[0] : 1 - part[0]) * (n & 2 ? part[1] : 1 - part[1]) *
                        (n & 4 ? part[2] : 1 - part[2]);
        sum += weight * (double)from[corner];
    }
    return sum;
}

double trip_light_grid_at(const trip_light_grid *g, trip_vec3 voxel)
{
    const double node[3] = { voxel.x / g->spacing, voxel.y / g->spacing, voxel.z / g->spacing };
    return trip_light_grid_at_node(g, node);
}
