#include "neighbours.h"

#include <limits>
#include <nanoflann.hpp>
#include <new>

namespace
{

struct cloud {
    const double (*positions)[3];
    size_t count;

    size_t kdtree_get_point_count() const
    {
        return count;
    }
    double kdtree_get_pt(size_t i, size_t axis) const
    {
        return positions[i][axis];
    }
    template <class B> bool kdtree_get_bbox(B &) const
    {
        return false;
    }
};

typedef nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, cloud>, cloud, 3>
    tree;

/* Receives the positions that a search finds. Positions at the greatest distance count, since their
 * order by coordinates decides. */
struct results {
    const cloud &from;
    trip_neighbours *to;

    double worstDist() const
    {
        const double reach2 = trip_neighbours_reach2(to);
        return reach2 + reach2 * std::numeric_limits<double>::epsilon();
    }
    bool addPoint(double distance2, size_t i)
    {
        trip_neighbours_add(to, distance2, from.positions[i]);
        return true;
    }
    bool full() const
    {
        return true;
    }
    size_t size() const
    {
        return to->count;
    }
};

const size_t leaf_positions = 10;

} // namespace

struct trip_neighbour_tree {
    cloud positions;
    tree index;

    trip_neighbour_tree(const double (*p)[3], size_t count)
        : positions{ p, count },
          index(3, positions, nanoflann::KDTreeSingleIndexAdaptorParams(leaf_positions))
    {
    }
};

bool trip_neighbour_trees_exist()
{
    return true;
}

trip_neighbour_tree *trip_neighbour_tree_make(const double (*positions)[3], size_t count)
{
    try {
        return new trip_neighbour_tree(positions, count);
    } catch (const std::bad_alloc &) {
        return nullptr;
    }
}

void trip_neighbour_tree_free(trip_neighbour_tree *t)
{
    delete t;
}

size_t trip_neighbour_tree_bytes(size_t count)
{
    /* A leaf may hold few positions: at worst, half the nodes are leaves of 5. */
    return sizeof(trip_neighbour_tree) + 4096 +
           count * (sizeof(size_t) + 2 * sizeof(tree::Node) / 5);
}

void trip_neighbour_tree_search(const trip_neighbour_tree *t, trip_neighbours *n)
{
    results found = { t->positions, n };
    t->index.findNeighbors(found, n->position, nanoflann::SearchParams());
}
