/* The octree of a Gaussian scene: cubes around all centres, divided until a cube holds few
 * Gaussians. A sample of the centres decides where. Nodes stand before the nodes inside them, in
 * the order of their places. One thread. */
#ifndef TRIP_GAUSSIAN_OCTREE_H
#define TRIP_GAUSSIAN_OCTREE_H

#include "budget.h"
#include "gaussian_sort.h"
#include "gaussian_tree.h"

enum {
    TRIP_OCTREE_LEAF_AIM = 1 << 15, /* of a scene */
    TRIP_OCTREE_LEAF_MIN = 64,      /* of a cloud */
    TRIP_OCTREE_DEPTH_MAX = 40,     /* of a leaf */
    TRIP_OCTREE_BITS = 52,          /* of a place along an axis */
};

typedef struct trip_octree_node {
    int64_t children[8]; /* all 0 in a leaf; bit a of the index tells the half along axis a */
    unsigned depth;
} trip_octree_node;

/* The place of a centre. Bit 51 is 1 in the upper half of the cube. Each lower bit halves again. */
typedef struct trip_octree_place {
    uint64_t at[3];
} trip_octree_place;

typedef struct trip_octree {
    double lo[3], side; /* of the whole cube */
    uint64_t leaf_aim;  /* the most records of a leaf, about */
    trip_octree_node *nodes;
    uint64_t node_count, room;
    trip_budget *budget;
} trip_octree;

/* Returns the leaf_aim of a cloud of points. Small clouds have several leaves too, and so coarse
 * levels. A scene file may place them thousands of times. */
static inline uint64_t trip_octree_cloud_aim(uint64_t records)
{
    const uint64_t aim = records > TRIP_OCTREE_LEAF_AIM ? TRIP_OCTREE_LEAF_AIM : records / 8;
    return aim > TRIP_OCTREE_LEAF_MIN ? aim : TRIP_OCTREE_LEAF_MIN;
}

/* Builds the octree for centres from `lo` to `hi`. Returns false if the budget is too small. */
bool trip_octree_build(trip_octree *o, const trip_gaussian_sample *sample, uint64_t records,
                       uint64_t leaf_aim, const double lo[3], const double hi[3],
                       trip_budget *budget);
void trip_octree_free(trip_octree *o);

trip_octree_place trip_octree_place_of(const trip_octree *o, const double centre[3]);
/* Returns the leaf of a place. Writes the nodes from the root to the leaf to `path`, which has room
 * for TRIP_OCTREE_DEPTH_MAX + 1, unless it is NULL. */
uint64_t trip_octree_leaf(const trip_octree *o, const trip_octree_place *p, uint64_t *path);
/* Returns a number that orders the places in a leaf by the octree's next 8 halvings. */
uint64_t trip_octree_order(const trip_octree_place *p, unsigned depth);
/* Sets group and coordinate for a sort in the octree's order: the leaf, and the place in it. */
void trip_octree_set_place(const trip_octree *o, const double centre[3], trip_spilled *head);
/* Returns how many halvings two places have in common, at most TRIP_OCTREE_BITS. */
unsigned trip_octree_common(const trip_octree_place *p, const trip_octree_place *q);

#endif
