/* In the place of neighbour_tree.cpp, for the small program. */
#include "neighbours.h"

bool trip_neighbour_trees_exist(void)
{
    return false;
}

trip_neighbour_tree *trip_neighbour_tree_make(const double (*positions)[3], size_t count)
{
    (void)positions, (void)count;
    return NULL;
}

void trip_neighbour_tree_free(trip_neighbour_tree *t)
{
    (void)t;
}

size_t trip_neighbour_tree_bytes(size_t count)
{
    (void)count;
    return 0;
}

void trip_neighbour_tree_search(const trip_neighbour_tree *t, trip_neighbours *n)
{
    (void)t, (void)n;
}
