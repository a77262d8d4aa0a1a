/* The nearest neighbours of a position, found in trees of positions. nanoflann holds the trees. A
 * tree is read-only once it is made, so threads may share it. */
#ifndef TRIP_NEIGHBOURS_H
#define TRIP_NEIGHBOURS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { TRIP_NEIGHBOURS_MIN = 3, TRIP_NEIGHBOURS_MAX = 64 };

typedef struct trip_neighbour {
    double distance2;
    double position[3];
} trip_neighbour;

/* The distinct positions nearest to a position, which does not count itself. They stand by
 * distance. Equal distances stand by x, y and z, so the order of the search does not matter. */
typedef struct trip_neighbours {
    double position[3];
    unsigned wanted, count;
    trip_neighbour nearest[TRIP_NEIGHBOURS_MAX];
} trip_neighbours;

/* Returns the squared distance beyond which no position is wanted. */
static inline double trip_neighbours_reach2(const trip_neighbours *n)
{
    return n->count < n->wanted ? __builtin_inf() : n->nearest[n->count - 1].distance2;
}

/* Returns below 0, 0 or above 0. */
static inline int trip_neighbour_compare(const trip_neighbour *a, double distance2,
                                         const double position[3])
{
    if (a->distance2 != distance2)
        return a->distance2 < distance2 ? -1 : 1;
    for (int i = 0; i < 3; i++)
        if (a->position[i] != position[i])
            return a->position[i] < position[i] ? -1 : 1;
    return 0;
}

static inline void trip_neighbours_add(trip_neighbours *n, double distance2,
                                       const double position[3])
{
    unsigned at = n->count;
    if (!(distance2 > 0))
        return;
    while (at > 0) {
        const int order = trip_neighbour_compare(&n->nearest[at - 1], distance2, position);
        if (order == 0)
            return;
        if (order < 0)
            break;
        at--;
    }
    if (at == n->wanted)
        return;
    const unsigned kept = n->count < n->wanted ? n->count : n->wanted - 1;
    for (unsigned i = kept; i > at; i--)
        n->nearest[i] = n->nearest[i - 1];
    n->nearest[at].distance2 = distance2;
    for (int i = 0; i < 3; i++)
        n->nearest[at].position[i] = position[i];
    n->count = kept + 1;
}

typedef struct trip_neighbour_tree trip_neighbour_tree;

/* Whether this program has trees. The small one does not. */
bool trip_neighbour_trees_exist(void);

/* Makes a tree of positions, which must outlive it. Returns NULL without memory. */
trip_neighbour_tree *trip_neighbour_tree_make(const double (*positions)[3], size_t count);
void trip_neighbour_tree_free(trip_neighbour_tree *t); /* NULL is allowed */
/* Returns the greatest number of bytes of a tree. */
size_t trip_neighbour_tree_bytes(size_t count);

/* Adds the nearest positions of a tree. */
void trip_neighbour_tree_search(const trip_neighbour_tree *t, trip_neighbours *n);

#ifdef __cplusplus
}
#endif

#endif
