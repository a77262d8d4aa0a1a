/* The division of a Gaussian scene into bricks along one axis. Each node of the octree and each
 * class of size in it has bricks of its own: a group. Slabs divide a group's coordinate along the
 * axis. Tiles divide a slab in the other two coordinates. A sample of the centres decides where.
 * The division depends on the records alone. One thread.
 */
#ifndef TRIP_GAUSSIAN_TREE_H
#define TRIP_GAUSSIAN_TREE_H

#include "budget.h"
#include "key_sort.h"

enum {
    TRIP_GAUSSIAN_BRICK_AIM = 4096,     /* records of a brick, about */
    TRIP_GAUSSIAN_SAMPLE_MAX = 1 << 22, /* points of a sample, so that any scene fits into memory */
};

typedef struct trip_gaussian_point {
    double centre[3];
    uint64_t group;
} trip_gaussian_point;

typedef struct trip_gaussian_sample {
    trip_gaussian_point *points;
    uint64_t count;
} trip_gaussian_sample;

/* A child below 0 is the leaf ~child. Centres below `value` go to the left. */
typedef struct trip_gaussian_node {
    double value;
    int64_t left, right;
    int32_t axis, reserved;
} trip_gaussian_node;

typedef struct trip_gaussian_leaf {
    _Atomic uint64_t records; /* counted by the caller */
    uint64_t group;
} trip_gaussian_leaf;

typedef struct trip_gaussian_tree {
    int64_t *roots; /* of the groups: children, as in a node */
    trip_gaussian_node *nodes;
    trip_gaussian_leaf *leaves; /* by group, then slab, then tile */
    uint64_t groups, node_count, leaf_count, room;
    trip_budget *budget;
} trip_gaussian_tree;

/* Whether a record belongs to the sample, from its number and the number of records. */
int trip_gaussian_is_sampled(uint64_t number, uint64_t records);
/* Returns the largest number of points in a sample of so many records. It is at most
 * TRIP_GAUSSIAN_SAMPLE_MAX + 1. */
uint64_t trip_gaussian_sample_room(uint64_t records);

/* `records` counts the records of each group. Returns false if the budget is too small. */
bool trip_gaussian_tree_build(trip_gaussian_tree *t, const trip_gaussian_sample *sample, int axis,
                              const uint64_t *records, uint64_t groups, trip_budget *budget);
uint64_t trip_gaussian_tree_leaf(const trip_gaussian_tree *t, const double centre[3],
                                 uint64_t group);
void trip_gaussian_tree_free(trip_gaussian_tree *t);

#endif
