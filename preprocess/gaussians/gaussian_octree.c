#include "gaussian_octree.h"

#include <math.h>

enum {
    HALVINGS = 8,
    AROUND = 16, /* the whole cube is so many times as wide as the centres' cube */
};

typedef struct build {
    trip_octree *octree;
    const trip_gaussian_sample *sample;
    trip_key *keys, *scratch;
    uint64_t leaf_points; /* the most points of a leaf */
} build;

trip_octree_place trip_octree_place_of(const trip_octree *o, const double centre[3])
{
    const double steps = 0x1p52;
    trip_octree_place p;
    for (int a = 0; a < 3; a++) {
        const double part = o->side > 0 ? (centre[a] - o->lo[a]) / o->side * steps : 0;
        p.at[a] = part < 0 ? 0 : part < steps ? (uint64_t)part : (UINT64_C(1) << 52) - 1;
    }
    return p;
}

static unsigned octant(const trip_octree_place *p, unsigned depth)
{
    const unsigned shift = TRIP_OCTREE_BITS - 1 - depth;
    return (unsigned)((p->at[0] >> shift & 1) | (p->at[1] >> shift & 1) << 1 |
                      (p->at[2] >> shift & 1) << 2);
}

uint64_t trip_octree_leaf(const trip_octree *o, const trip_octree_place *p, uint64_t *path)
{
    uint64_t at = 0;
    for (unsigned depth = 0;; depth++) {
        if (path)
            path[depth] = at;
        const int64_t child = o->nodes[at].children[octant(p, depth)];
        if (!child)
            return at;
        at = (uint64_t)child;
    }
}

uint64_t trip_octree_order(const trip_octree_place *p, unsigned depth)
{
    uint64_t order = 0;
    for (unsigned i = 0; i < HALVINGS; i++)
        order = order << 3 | octant(p, depth + i);
    return order;
}

void trip_octree_set_place(const trip_octree *o, const double centre[3], trip_spilled *head)
{
    const trip_octree_place p = trip_octree_place_of(o, centre);
    head->group = trip_octree_leaf(o, &p, NULL);
    head->at = (double)trip_octree_order(&p, o->nodes[head->group].depth);
}

unsigned trip_octree_common(const trip_octree_place *p, const trip_octree_place *q)
{
    uint64_t differ = 0;
    for (int a = 0; a < 3; a++)
        differ |= p->at[a] ^ q->at[a];
    return differ ? (unsigned)__builtin_clzll(differ) - (64 - TRIP_OCTREE_BITS) : TRIP_OCTREE_BITS;
}

/* Sorts points lo to hi by their octant. Returns the number of the node. */
static int64_t build_node(build *b, uint64_t lo, uint64_t hi, unsigned depth)
{
    trip_octree *o = b->octree;
    const uint64_t made = o->node_count++;
    uint64_t ends[8] = { 0 };
    o->nodes[made] = (trip_octree_node){ .depth = depth };
    if (hi - lo <= b->leaf_points || depth == TRIP_OCTREE_DEPTH_MAX)
        return (int64_t)made;
    for (uint64_t i = lo; i < hi; i++) {
        const trip_octree_place p =
            trip_octree_place_of(o, b->sample->points[b->keys[i].number].centre);
        b->keys[i].key = octant(&p, depth);
        ends[b->keys[i].key]++;
    }
    trip_key_sort(b->keys + lo, b->scratch, hi - lo);
    for (int i = 0; i < 8; i++) {
        const int64_t child = build_node(b, lo, lo + ends[i], depth + 1);
        lo += ends[i];
        o->nodes[made].children[i] = child;
    }
    return (int64_t)made;
}

/* Each division makes 8 nodes of more than leaf_points points. Divisions that move all points to
 * one child count too. */
static uint64_t count_nodes(build *b, uint64_t lo, uint64_t hi, unsigned depth)
{
    uint64_t ends[8] = { 0 }, nodes = 1;
    if (hi - lo <= b->leaf_points || depth == TRIP_OCTREE_DEPTH_MAX)
        return 1;
    for (uint64_t i = lo; i < hi; i++) {
        const trip_octree_place p =
            trip_octree_place_of(b->octree, b->sample->points[b->keys[i].number].centre);
        b->keys[i].key = octant(&p, depth);
        ends[b->keys[i].key]++;
    }
    trip_key_sort(b->keys + lo, b->scratch, hi - lo);
    for (int i = 0; i < 8; lo += ends[i++])
        nodes += count_nodes(b, lo, lo + ends[i], depth + 1);
    return nodes;
}

static size_t nodes_bytes(const trip_octree *o)
{
    return o->room * sizeof *o->nodes;
}

static void set_cube(trip_octree *o, const double lo[3], const double hi[3])
{
    o->side = 0;
    for (int a = 0; a < 3; a++)
        o->side = fmax(o->side, hi[a] - lo[a]);
    for (int a = 0; a < 3; a++)
        o->lo[a] = (lo[a] + hi[a]) / 2 - o->side / 2;
    o->side *= AROUND;
}

bool trip_octree_build(trip_octree *o, const trip_gaussian_sample *sample, uint64_t records,
                       uint64_t leaf_aim, const double lo[3], const double hi[3],
                       trip_budget *budget)
{
    const size_t bytes = 2 * (sample->count + 1) * sizeof(trip_key);
    const double share = (double)sample->count / (double)records;
    *o = (trip_octree){ .leaf_aim = leaf_aim, .budget = budget };
    set_cube(o, lo, hi);
    trip_key *keys = trip_budget_take(budget, bytes);
    build b = { o, sample, keys, keys + sample->count + 1,
                (uint64_t)fmax(1, (double)leaf_aim * share) };
    for (uint64_t i = 0; keys && i < sample->count; i++)
        keys[i].number = i;
    o->room = keys ? count_nodes(&b, 0, sample->count, 0) : 0;
    o->nodes = keys ? trip_budget_take(budget, nodes_bytes(o)) : NULL;
    if (o->nodes)
        build_node(&b, 0, sample->count, 0);
    trip_budget_release(budget, keys, bytes);
    return o->nodes != NULL;
}

void trip_octree_free(trip_octree *o)
{
    if (o->nodes)
        trip_budget_release(o->budget, o->nodes, nodes_bytes(o));
    *o = (trip_octree){ .nodes = NULL };
}
