#include "neighbours.h"

#include <string.h>

/* Returns below 0, 0 or above 0. */
static int compare(const trip_neighbour *a, double distance2, const double position[3])
{
    if (a->distance2 != distance2)
        return a->distance2 < distance2 ? -1 : 1;
    for (int i = 0; i < 3; i++)
        if (a->position[i] != position[i])
            return a->position[i] < position[i] ? -1 : 1;
    return 0;
}

void trip_neighbours_add(trip_neighbours *n, double distance2, const double position[3])
{
    unsigned at = n->count;
    if (!(distance2 > 0))
        return;
    while (at > 0) {
        const int order = compare(&n->nearest[at - 1], distance2, position);
        if (order == 0)
            return;
        if (order < 0)
            break;
        at--;
    }
    if (at == n->wanted)
        return;
    const unsigned kept = n->count < n->wanted ? n->count : n->wanted - 1;
    memmove(&n->nearest[at + 1], &n->nearest[at], (kept - at) * sizeof *n->nearest);
    n->nearest[at] = (trip_neighbour){ distance2, { position[0], position[1], position[2] } };
    n->count = kept + 1;
}
