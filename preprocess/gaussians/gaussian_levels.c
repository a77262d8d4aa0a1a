#include "gaussian_levels.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "report.h"

enum {
    FEWER = 2,
    FEW_PART = 8,
    VOXELS = TRIP_OCTREE_DEPTH_MAX + TRIP_LEVEL_HALVINGS,
    CHUNK = 32, /* Gaussians of an item of work */
    BATCH_MIN = 32,
    BATCH_MAX = 8192,
    MEMORY_PART = 4,
};

/* A Gaussian is merged if its deviations are at most this part of a voxel's width. */
#define MERGED_PART 0.75

static_assert((int)VOXELS < 64, "each depth has a bit");

/* A node of the octree. */
typedef struct part {
    uint64_t counts[TRIP_LEVEL_HALVINGS + 1]; /* Gaussians, if voxels halve the node k times */
    uint64_t records;                         /* 0: not kept */
    unsigned halvings;
} part;

/* A coarse Gaussian that waits for the workers and for its turn. */
typedef struct waiting {
    uint64_t node;
    bool merged; /* `g` comes from `moments` */
    trip_gaussian g;
    trip_gaussian_moments moments;
} waiting;

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
    uint64_t open; /* a bit for each depth with an open voxel */
    /* These belong to the second pass. */
    size_t batch; /* the most Gaussians of each table below */
    void *tables;
    waiting *filling, *sent;       /* queues: one is filled while workers merge the other */
    size_t filled, sent_count;     /* Gaussians in them */
    trip_gaussian_moments *own;    /* of the Gaussians that are added */
    trip_gaussian_moments *coming; /* of the next ones, which workers find */
    const unsigned char *next;     /* the next ones */
    size_t stride, next_count, next_chunks;
    bool running; /* a loop of the workers */
};

static size_t parts_bytes(const trip_octree *o)
{
    return o->node_count * sizeof(part);
}

static size_t tables_bytes(const trip_gaussian_levels *l)
{
    return l->batch * 2 * (sizeof(waiting) + sizeof(trip_gaussian_moments));
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
    int status;
    if (l->running)
        trip_workers_wait(l->p.workers, 0, &status);
    if (l->tables)
        trip_budget_release(budget, l->tables, tables_bytes(l));
    trip_budget_release(budget, l->parts, parts_bytes(l->p.octree));
    trip_budget_release(budget, l, sizeof *l);
}

static double voxel_width(const trip_gaussian_levels *l, unsigned depth)
{
    return ldexp(l->p.octree->side, -(int)depth);
}

/* Copies a Gaussian that has only the coefficients up to the degree. */
static void copy_gaussian(const trip_gaussian_levels *l, trip_gaussian *to, const trip_gaussian *g)
{
    memcpy(to, g,
           offsetof(trip_gaussian, sh) + (size_t)trip_sh_count(l->p.degree) * sizeof g->sh[0]);
}

/* ---- the workers ---- */

static size_t chunks_of(size_t count)
{
    return (count + CHUNK - 1) / CHUNK;
}

static int do_chunk(void *user, unsigned thread, uint64_t item)
{
    trip_gaussian_levels *l = user;
    const bool finds = item < l->next_chunks;
    const size_t first = CHUNK * (size_t)(finds ? item : item - l->next_chunks);
    const size_t count = finds ? l->next_count : l->sent_count;
    (void)thread;
    for (size_t i = first; i < count && i < first + CHUNK; i++)
        if (finds)
            trip_gaussian_moments_of((const void *)(l->next + i * l->stride), l->p.degree,
                                     &l->coming[i]);
        else if (l->sent[i].merged)
            l->sent[i].g = trip_gaussian_moments_merge(&l->sent[i].moments, l->p.degree);
    return TRIP_OK;
}

/* Waits for the loop, and emits the Gaussians that it merged. */
static int end_loop(trip_gaussian_levels *l)
{
    int status = TRIP_OK;
    if (!l->running)
        return TRIP_OK;
    l->running = false;
    trip_workers_wait(l->p.workers, 0, &status);
    for (size_t i = 0; i < l->sent_count && status == TRIP_OK; i++)
        status = l->p.emit(l->p.user, l->sent[i].node, &l->sent[i].g);
    l->sent_count = 0;
    return status;
}

/* Starts a loop for the queue and the next Gaussians. */
static int start_loop(trip_gaussian_levels *l, const unsigned char *next, size_t count)
{
    waiting *sent = l->filling;
    const int status = end_loop(l);
    if (status < 0)
        return status;
    l->filling = l->sent;
    l->sent = sent;
    l->sent_count = l->filled;
    l->filled = 0;
    l->next = next;
    l->next_count = count;
    l->next_chunks = chunks_of(count);
    l->running = true;
    trip_workers_start(l->p.workers, do_chunk, l, l->next_chunks + chunks_of(l->sent_count));
    return TRIP_OK;
}

/* Adds a coarse Gaussian of a node to the queue; `moments` NULL means `g` itself. */
static int add_coarse(trip_gaussian_levels *l, uint64_t node, const trip_gaussian *g,
                      const trip_gaussian_moments *moments)
{
    const int status = l->filled == l->batch ? start_loop(l, NULL, 0) : TRIP_OK;
    if (status < 0)
        return status;
    waiting *to = &l->filling[l->filled++];
    to->node = node;
    to->merged = moments != NULL;
    if (moments)
        memcpy(&to->moments, moments, trip_gaussian_moments_bytes(l->p.degree));
    else
        copy_gaussian(l, &to->g, g);
    return TRIP_OK;
}

/* ---- voxels ---- */

/* The first pass only counts. */
static void add_to_voxel(trip_gaussian_levels *l, unsigned depth, const trip_gaussian *first,
                         const trip_gaussian_moments *moments)
{
    voxel *v = &l->voxels[depth];
    l->open |= UINT64_C(1) << depth;
    if (!l->merges) {
        v->moments.count += moments->count;
        return;
    }
    if (!v->moments.count)
        copy_gaussian(l, &v->first, first);
    trip_gaussian_moments_add(&v->moments, moments, l->p.degree);
}

/* Closes the open voxel at a depth: counts or emits it for the nodes around it, and adds it to the
 * voxel around it. */
static int close_voxel(trip_gaussian_levels *l, unsigned depth)
{
    voxel *v = &l->voxels[depth];
    int status = TRIP_OK;
    for (unsigned k = 1; k <= TRIP_LEVEL_HALVINGS && k <= depth && status == TRIP_OK; k++) {
        if (depth - k >= l->depth)
            continue;
        const uint64_t node = l->path[depth - k];
        part *n = &l->parts[node];
        if (!l->merges) {
            n->counts[k]++;
        } else if (n->records && n->halvings == k) {
            status = add_coarse(l, node, &v->first, v->moments.count == 1 ? NULL : &v->moments);
        }
    }
    if (depth > 0) {
        add_to_voxel(l, depth - 1, &v->first, &v->moments);
    }
    v->moments.count = 0;
    l->open &= ~(UINT64_C(1) << depth);
    return status;
}

/* Closes the open voxels at a depth and below it. */
static int close_from(trip_gaussian_levels *l, unsigned depth)
{
    int status = TRIP_OK;
    while (status == TRIP_OK && l->open >> depth)
        status = close_voxel(l, 63 - (unsigned)__builtin_clzll(l->open));
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
            status = add_coarse(l, l->path[depth], g, NULL);
    }
    return status;
}

/* Adds a Gaussian. `own` has its moments; in the first pass only the number, 1. */
static int add(trip_gaussian_levels *l, const trip_gaussian *g, bool has_mass,
               const trip_gaussian_moments *own)
{
    const trip_octree_place place = trip_octree_place_of(l->p.octree, g->centre);
    const unsigned common = l->any ? trip_octree_common(&l->place, &place) : 0;
    int status = close_from(l, common + 1);
    if (!l->any || common < l->depth) { /* another leaf */
        const uint64_t leaf = trip_octree_leaf(l->p.octree, &place, l->path);
        l->depth = l->p.octree->nodes[leaf].depth;
    }
    l->any = true;
    l->place = place;
    if (!l->merges)
        l->parts[l->path[l->depth]].records++;
    if (status < 0 || g->opacity * 255 <= 1)
        return status;
    const int merging = has_mass ? merging_depth(l, g, l->depth + TRIP_LEVEL_HALVINGS - 1) : -1;
    if (merging >= 0)
        add_to_voxel(l, (unsigned)merging, g, own);
    return keep_whole(l, g, merging);
}

int trip_gaussian_levels_count(trip_gaussian_levels *l, const trip_gaussian *g)
{
    static const trip_gaussian_moments one = { .count = 1 };
    return add(l, g, trip_gaussian_has_mass(g), &one);
}

int trip_gaussian_levels_merge(trip_gaussian_levels *l, const unsigned char *splats, size_t stride,
                               size_t count)
{
    l->stride = stride;
    int status = start_loop(l, splats, count < l->batch ? count : l->batch);
    for (size_t at = 0, n = 0; at < count && status == TRIP_OK; at += n) {
        const size_t left = count - at;
        n = left < l->batch ? left : l->batch;
        status = end_loop(l);
        trip_gaussian_moments *own = l->coming;
        l->coming = l->own;
        l->own = own;
        if (status == TRIP_OK)
            status = start_loop(l, splats + (at + n) * stride,
                                left - n < l->batch ? left - n : l->batch);
        for (size_t i = 0; i < n && status == TRIP_OK; i++) {
            status = add(l, (const void *)(splats + (at + i) * stride), own[i].mass > 0, &own[i]);
        }
    }
    return status;
}

/* Selects the voxels of a node and of all nodes inside it. Returns the number of its Gaussians. A
 * node that is not kept returns the Gaussians of the nodes inside it. */
static uint64_t select_node(trip_gaussian_levels *l, uint64_t node)
{
    const trip_octree_node *n = &l->p.octree->nodes[node];
    part *p = &l->parts[node];
    const uint64_t few = l->p.octree->leaf_aim / FEW_PART;
    uint64_t inside = 0;
    if (!n->children[0])
        return p->records;
    for (int i = 0; i < 8; i++)
        inside += select_node(l, (uint64_t)n->children[i]);
    for (unsigned k = 2; k <= TRIP_LEVEL_HALVINGS && inside > few; k++)
        if (p->counts[k] > 0 && p->counts[k] <= inside / FEWER &&
            p->counts[k] <= TRIP_LEVEL_RECORDS_MAX) {
            p->records = p->counts[k];
            p->halvings = k;
        }
    l->coarse += p->records;
    return p->records ? p->records : inside;
}

static int close_all(trip_gaussian_levels *l)
{
    l->any = false;
    return close_from(l, 0);
}

bool trip_gaussian_levels_select(trip_gaussian_levels *l)
{
    close_all(l);
    select_node(l, 0);
    l->merges = true;
    l->batch = 1;
    const uint64_t most = trip_budget_left_bytes(l->budget) / MEMORY_PART / tables_bytes(l);
    l->batch = most < BATCH_MIN ? BATCH_MIN : most > BATCH_MAX ? BATCH_MAX : (size_t)most;
    l->tables = trip_budget_take(l->budget, tables_bytes(l));
    if (!l->tables)
        return false;
    l->filling = l->tables;
    l->sent = l->filling + l->batch;
    l->own = (void *)(l->sent + l->batch);
    l->coming = l->own + l->batch;
    return true;
}

int trip_gaussian_levels_end(trip_gaussian_levels *l)
{
    int status = close_all(l);
    if (status == TRIP_OK)
        status = start_loop(l, NULL, 0);
    return status == TRIP_OK ? end_loop(l) : status;
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
