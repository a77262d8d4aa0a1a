#include "gaussian_levels.h"

#include <math.h>
#include <string.h>

#include "report.h"

enum { FEWER = 2, FEW = 4096, VOXELS = TRIP_OCTREE_DEPTH_MAX + TRIP_LEVEL_HALVINGS };

/* A Gaussian is merged if its deviations are at most this part of a voxel's width. */
#define MERGED_PART 0.75

/* A node of the octree. */
typedef struct part {
    uint64_t counts[TRIP_LEVEL_HALVINGS + 1]; /* Gaussians, if voxels halve the node k times */
    uint64_t records;                         /* 0: not kept */
    unsigned halvings;
} part;

/* The voxel that is open at a depth. */
typedef struct voxel {
    trip_gaussian_moments moments;
    trip_gaussian first;
} voxel;

struct trip_gaussian_levels {
    trip_gaussian_levels_params p;
    trip_budget *budget;
    part *parts;             /* of the octree's nodes */
    bool merges;             /* second pass */
    bool any;                /* a Gaussian came in this pass */
    trip_octree_place place; /* of the last Gaussian */
    uint64_t path[TRIP_OCTREE_DEPTH_MAX + 1];
    unsigned depth; /* of its leaf */
    unsigned deepest;
    uint64_t coarse;
    voxel voxels[VOXELS];
};

static size_t parts_bytes(const trip_octree *o)
{
    return o->node_count * sizeof(part);
}

bool trip_gaussian_levels_begin(trip_gaussian_levels **out,
                                const trip_gaussian_levels_params *params, trip_budget *budget)
{
    trip_gaussian_levels *l = *out = trip_budget_take(budget, sizeof *l);
    if (!l)
        return false;
    l->p = *params;
    l->budget = budget;
    l->parts = trip_budget_take(budget, parts_bytes(params->octree));
    return l->parts != NULL;
}

void trip_gaussian_levels_free(trip_gaussian_levels *l)
{
    if (!l)
        return;
    trip_budget *budget = l->budget;
    trip_budget_release(budget, l->parts, parts_bytes(l->p.octree));
    trip_budget_release(budget, l, sizeof *l);
}

static double voxel_width(const trip_gaussian_levels *l, unsigned depth)
{
    return ldexp(l->p.octree->side, -(int)depth);
}

/* Closes the voxel at a depth: counts or emits it for the nodes around it, and adds it to the voxel
 * around it. */
static int close_voxel(trip_gaussian_levels *l, unsigned depth)
{
    voxel *v = &l->voxels[depth];
    int status = TRIP_OK;
    if (!v->moments.count)
        return TRIP_OK;
    for (unsigned k = 1; k <= TRIP_LEVEL_HALVINGS && k <= depth && status == TRIP_OK; k++) {
        if (depth - k >= l->depth)
            continue;
        const uint64_t node = l->path[depth - k];
        part *n = &l->parts[node];
        if (!l->merges) {
            n->counts[k]++;
        } else if (n->records && n->halvings == k) {
            const trip_gaussian merged =
                v->moments.count == 1 ? v->first
                                      : trip_gaussian_moments_merge(&v->moments, l->p.degree);
            status = l->p.emit(l->p.user, node, &merged);
        }
    }
    if (depth > 0) {
        voxel *around = &l->voxels[depth - 1];
        if (!around->moments.count)
            around->first = v->first;
        trip_gaussian_moments_add(&around->moments, &v->moments, l->p.degree);
    }
    v->moments.count = 0;
    return status;
}

static int close_below(trip_gaussian_levels *l, unsigned common)
{
    int status = TRIP_OK;
    for (unsigned depth = VOXELS - 1; depth > common && status == TRIP_OK; depth--)
        status = close_voxel(l, depth);
    return status;
}

/* Returns the depth of the smallest voxel that merges a Gaussian, at most `limit`; -1 if none does.
 */
static int merging_depth(const trip_gaussian_levels *l, const trip_gaussian *g, unsigned limit)
{
    const double most = (double)fmaxf(g->deviations[0], fmaxf(g->deviations[1], g->deviations[2]));
    int depth = (int)limit;
    while (depth >= 0 && MERGED_PART * voxel_width(l, (unsigned)depth) < most)
        depth--;
    return depth;
}

/* Gives a Gaussian to the nodes that have too small voxels for it. */
static int keep_whole(trip_gaussian_levels *l, const trip_gaussian *g, int merging)
{
    int status = TRIP_OK;
    for (unsigned depth = 0; depth < l->depth && status == TRIP_OK; depth++) {
        part *n = &l->parts[l->path[depth]];
        for (unsigned k = 1; k <= TRIP_LEVEL_HALVINGS && !l->merges; k++)
            n->counts[k] += (int)(depth + k) > merging;
        if (l->merges && n->records && (int)(depth + n->halvings) > merging)
            status = l->p.emit(l->p.user, l->path[depth], g);
    }
    return status;
}

int trip_gaussian_levels_add(trip_gaussian_levels *l, const trip_gaussian *g, uint64_t *leaf)
{
    const trip_octree_place place = trip_octree_place_of(l->p.octree, g->centre);
    trip_gaussian_moments own;
    int status = l->any ? close_below(l, trip_octree_common(&l->place, &place)) : TRIP_OK;
    *leaf = trip_octree_leaf(l->p.octree, &place, l->path);
    l->any = true;
    l->place = place;
    l->depth = l->p.octree->nodes[*leaf].depth;
    if (!l->merges)
        l->parts[*leaf].records++;
    if (status < 0 || g->opacity * 255 <= 1)
        return status;
    trip_gaussian_moments_of(g, l->p.degree, &own);
    const int merging = own.mass > 0 ? merging_depth(l, g, l->depth + TRIP_LEVEL_HALVINGS - 1) : -1;
    if (merging >= 0) {
        voxel *v = &l->voxels[merging];
        if (!v->moments.count)
            v->first = *g;
        trip_gaussian_moments_add(&v->moments, &own, l->p.degree);
    }
    return keep_whole(l, g, merging);
}

/* Selects the voxels of a node and of all nodes inside it. Returns the number of its Gaussians. A
 * node that is not kept returns the Gaussians of the nodes inside it. */
static uint64_t select_node(trip_gaussian_levels *l, uint64_t node)
{
    const trip_octree_node *n = &l->p.octree->nodes[node];
    part *p = &l->parts[node];
    uint64_t inside = 0;
    if (!n->children[0])
        return p->records;
    for (int i = 0; i < 8; i++)
        inside += select_node(l, (uint64_t)n->children[i]);
    for (unsigned k = 2; k <= TRIP_LEVEL_HALVINGS && inside > FEW; k++)
        if (p->counts[k] > 0 && p->counts[k] <= inside / FEWER &&
            p->counts[k] <= TRIP_LEVEL_RECORDS_MAX) {
            p->records = p->counts[k];
            p->halvings = k;
        }
    l->coarse += p->records;
    return p->records ? p->records : inside;
}

int trip_gaussian_levels_end_pass(trip_gaussian_levels *l)
{
    int status = l->any ? close_below(l, 0) : TRIP_OK;
    if (status == TRIP_OK)
        status = close_voxel(l, 0);
    l->any = false;
    if (!l->merges)
        select_node(l, 0);
    l->merges = true;
    return status;
}

uint64_t trip_gaussian_levels_records(const trip_gaussian_levels *l, uint64_t node)
{
    return l->parts[node].records;
}

double trip_gaussian_levels_width(const trip_gaussian_levels *l, uint64_t node)
{
    const trip_octree_node *n = &l->p.octree->nodes[node];
    return n->children[0] ? voxel_width(l, n->depth + l->parts[node].halvings) : 0;
}

uint64_t trip_gaussian_levels_coarse(const trip_gaussian_levels *l)
{
    return l->coarse;
}
