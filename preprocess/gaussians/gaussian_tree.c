#include "gaussian_tree.h"

#include <math.h>

enum { SAMPLE_STRIDE = 64, SAMPLE_WHOLE = 1 << 14 };

typedef struct build {
    trip_gaussian_tree *tree;
    const trip_gaussian_point *points;
    trip_key *keys, *scratch;
    int axis;
    uint64_t group, slabs, tiles; /* of the group */
} build;

static uint64_t sample_stride(uint64_t records)
{
    const uint64_t stride = records / SAMPLE_WHOLE;
    const uint64_t least = (records + TRIP_GAUSSIAN_SAMPLE_MAX - 1) / TRIP_GAUSSIAN_SAMPLE_MAX;
    const uint64_t usual = stride < 1 ? 1 : stride > SAMPLE_STRIDE ? SAMPLE_STRIDE : stride;
    return usual > least ? usual : least;
}

int trip_gaussian_is_sampled(uint64_t number, uint64_t records)
{
    const uint64_t stride = sample_stride(records);
    /* One record of each `stride` records, at a place that a mixing of bits decides. */
    uint64_t mix = number / stride * UINT64_C(0x9E3779B97F4A7C15);
    mix ^= mix >> 32;
    return number % stride == mix % stride;
}

uint64_t trip_gaussian_sample_room(uint64_t records)
{
    return records / sample_stride(records) + 1;
}

static void sort_along(build *b, uint64_t lo, uint64_t hi, int axis)
{
    for (uint64_t i = lo; i < hi; i++)
        b->keys[i].key = trip_key_of(b->points[b->keys[i].number].centre[axis]);
    trip_key_sort(b->keys + lo, b->scratch, hi - lo);
}

static double coordinate(const build *b, uint64_t i, int axis)
{
    return b->points[b->keys[i].number].centre[axis];
}

/* Returns the extent along an axis without the outer twentieths. */
static double extent(build *b, uint64_t lo, uint64_t hi, int axis)
{
    const uint64_t cut = (hi - lo) / 20;
    sort_along(b, lo, hi, axis);
    return hi > lo ? coordinate(b, hi - 1 - cut, axis) - coordinate(b, lo + cut, axis) : 0;
}

/* Adds a node that sends about left / (left + right) of the points to the left. Returns the first
 * point on the right. */
static uint64_t split(build *b, uint64_t lo, uint64_t hi, int axis, uint64_t left, uint64_t right,
                      int64_t *node)
{
    trip_gaussian_tree *t = b->tree;
    uint64_t at = lo + (uint64_t)((double)(hi - lo) * (double)left / (double)(left + right));
    *node = (int64_t)t->node_count++;
    t->nodes[*node] = (trip_gaussian_node){ .axis = axis };
    if (lo == hi)
        return at;
    sort_along(b, lo, hi, axis);
    while (at > lo && b->keys[at - 1].key == b->keys[at].key)
        at--;
    t->nodes[*node].value = coordinate(b, at, axis);
    return at;
}

static int64_t build_tiles(build *b, uint64_t lo, uint64_t hi, uint64_t tiles)
{
    trip_gaussian_tree *t = b->tree;
    if (tiles == 1) {
        t->leaves[t->leaf_count] = (trip_gaussian_leaf){ .group = b->group };
        return ~(int64_t)t->leaf_count++;
    }
    const int u = (b->axis + 1) % 3, v = (b->axis + 2) % 3;
    const int axis = extent(b, lo, hi, u) >= extent(b, lo, hi, v) ? u : v;
    int64_t node;
    const uint64_t at = split(b, lo, hi, axis, tiles / 2, tiles - tiles / 2, &node);
    t->nodes[node].left = build_tiles(b, lo, at, tiles / 2);
    t->nodes[node].right = build_tiles(b, at, hi, tiles - tiles / 2);
    return node;
}

/* Returns the number of tiles in the slabs before `slab`. */
static uint64_t tiles_before(const build *b, uint64_t slab)
{
    return slab * b->tiles / b->slabs;
}

static int64_t build_slabs(build *b, uint64_t lo, uint64_t hi, uint64_t first, uint64_t end)
{
    const uint64_t middle = first + (end - first) / 2;
    const uint64_t left = tiles_before(b, middle) - tiles_before(b, first);
    const uint64_t right = tiles_before(b, end) - tiles_before(b, middle);
    if (end - first == 1)
        return build_tiles(b, lo, hi, left + right);
    int64_t node;
    const uint64_t at = split(b, lo, hi, b->axis, left, right, &node);
    b->tree->nodes[node].left = build_slabs(b, lo, at, first, middle);
    b->tree->nodes[node].right = build_slabs(b, at, hi, middle, end);
    return node;
}

static uint64_t leaf_aim(uint64_t records)
{
    return (records + TRIP_GAUSSIAN_BRICK_AIM - 1) / TRIP_GAUSSIAN_BRICK_AIM;
}

/* Groups of usual leaves have slabs alone. The thinner bricks are along the axis, the fewer are
 * open at a time. */
static uint64_t slabs_of(uint64_t bricks)
{
    enum { SLABS_ALONE = 16 };
    const uint64_t cube = (uint64_t)(cbrt((double)bricks) + 0.5);
    return bricks <= SLABS_ALONE ? bricks : cube > SLABS_ALONE ? cube : SLABS_ALONE;
}

static void build_groups(build *b, uint64_t count, const uint64_t *records)
{
    uint64_t lo = 0;
    for (uint64_t i = 0; i < count; i++)
        b->keys[i] = (trip_key){ b->points[i].group, i };
    trip_key_sort(b->keys, b->scratch, count);
    for (uint64_t group = 0; group < b->tree->groups; group++) {
        uint64_t hi = lo;
        while (hi < count && b->points[b->keys[hi].number].group == group)
            hi++;
        if (records[group]) {
            b->group = group;
            b->tiles = leaf_aim(records[group]);
            b->slabs = slabs_of(b->tiles);
            b->tree->roots[group] = build_slabs(b, lo, hi, 0, b->slabs);
        }
        lo = hi;
    }
}

static size_t nodes_bytes(const trip_gaussian_tree *t)
{
    return t->room * sizeof *t->nodes;
}

static size_t leaves_bytes(const trip_gaussian_tree *t)
{
    return t->room * sizeof *t->leaves;
}

static size_t roots_bytes(const trip_gaussian_tree *t)
{
    return t->groups * sizeof *t->roots;
}

bool trip_gaussian_tree_build(trip_gaussian_tree *t, const trip_gaussian_sample *sample, int axis,
                              const uint64_t *records, uint64_t groups, trip_budget *budget)
{
    const size_t bytes = 2 * (sample->count + 1) * sizeof(trip_key);
    *t = (trip_gaussian_tree){ .groups = groups, .budget = budget };
    for (uint64_t group = 0; group < groups; group++)
        t->room += leaf_aim(records[group]);
    t->roots = trip_budget_take(budget, roots_bytes(t));
    t->nodes = trip_budget_take(budget, nodes_bytes(t));
    t->leaves = trip_budget_take(budget, leaves_bytes(t));
    trip_key *keys = trip_budget_take(budget, bytes);
    const bool built = t->roots && t->nodes && t->leaves && keys;
    if (built)
        build_groups(&(build){ .tree = t,
                               .points = sample->points,
                               .keys = keys,
                               .scratch = keys + sample->count + 1,
                               .axis = axis },
                     sample->count, records);
    trip_budget_release(budget, keys, bytes);
    if (!built)
        trip_gaussian_tree_free(t);
    return built;
}

uint64_t trip_gaussian_tree_leaf(const trip_gaussian_tree *t, const double centre[3],
                                 uint64_t group)
{
    int64_t at = t->roots[group];
    while (at >= 0) {
        const trip_gaussian_node *n = &t->nodes[at];
        at = centre[n->axis] < n->value ? n->left : n->right;
    }
    return (uint64_t)~at;
}

void trip_gaussian_tree_free(trip_gaussian_tree *t)
{
    if (t->roots)
        trip_budget_release(t->budget, t->roots, roots_bytes(t));
    if (t->nodes)
        trip_budget_release(t->budget, t->nodes, nodes_bytes(t));
    if (t->leaves)
        trip_budget_release(t->budget, t->leaves, leaves_bytes(t));
    *t = (trip_gaussian_tree){ .nodes = NULL };
}
