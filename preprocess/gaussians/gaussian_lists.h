/* Makes the bricks of the nodes of an octree in all three lists. A node's splats are together in a
 * file, so a node is read once and sorted in memory. The workers do several nodes at once. The
 * bricks reach the writer in the order of the nodes. One thread owns the lists. */
#ifndef TRIP_GAUSSIAN_LISTS_H
#define TRIP_GAUSSIAN_LISTS_H

#include "gaussian_tree.h"
#include "gaussian_writer.h"
#include "output.h"
#include "workers.h"

typedef struct trip_gaussian_lists trip_gaussian_lists;

typedef struct trip_gaussian_lists_params {
    trip_gaussian_writer *writer;
    trip_workers *workers; /* no other loop runs */
    int degree;
    const trip_gaussian_tree *trees; /* one for each axis */
    /* The indices of classes: class c has the index c + 128. A node has class_count groups, from
     * index class_lo on. Splats of index i join the group of index
     * joined[node * class_count + i - class_lo]. */
    const uint8_t *joined;
    uint64_t class_count;
    int class_lo;
} trip_gaussian_lists_params;

/* A node, and where its spilled splats (gaussian_sort.h) are. */
typedef struct trip_listed_node {
    uint64_t node, number; /* of the octree, and of the data set */
    const trip_output *from;
    uint64_t first, count;
} trip_listed_node;

/* Takes at most half of the budget's free memory. Nodes of more than `wanted` splats do not come.
 * Returns false, and sets *out to NULL, if the budget is too small. */
bool trip_gaussian_lists_begin(trip_gaussian_lists **out, const trip_gaussian_lists_params *params,
                               uint64_t wanted, trip_budget *budget);
/* Returns the most splats of a node that the memory has room for, at most `wanted`. NULL has none.
 */
uint64_t trip_gaussian_lists_room(const trip_gaussian_lists *l);
/* Adds the next node, of at most so many splats. */
int trip_gaussian_lists_add(trip_gaussian_lists *l, const trip_listed_node *node);
/* Waits until the writer has the bricks of all nodes. No loop runs then. NULL has none.
 */
int trip_gaussian_lists_finish(trip_gaussian_lists *l);
void trip_gaussian_lists_free(trip_gaussian_lists *l); /* NULL is allowed */

#endif
