#include "brick_gaussians.h"

#include "folder.h"
#include "gaussian_check.h"
#include "gaussian_code.h"
#include "gaussian_encoder.h"
#include "gaussian_levels.h"
#include "gaussian_lists.h"
#include "gaussian_sort.h"
#include "gaussian_writer.h"
#include "harmonics_palette.h"
#include "report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BATCH = 128,
    SPOOL_BYTES = 1 << 17,
    PROGRESS_EVERY = 1 << 14,
    CLASSES = 256,       /* class c has the index c + 128 */
    GROUP_RECORDS = 512, /* classes of a node with fewer records join larger classes */
    READ_MIN = 1024,     /* splats that are read at once */
    READ_MAX = 1 << 16,
    READ_PART = 4,    /* at most this part of the free memory */
    MERGED_MAX = 256, /* splats of a node's buffer */
    MERGED_PART = 16, /* of the free memory, at most, for all these buffers */
};

/* The greatest mean error of colours by a palette that is selected by itself. */
#define PALETTE_ERROR (0.5 / 255)

/* Coarse splats of a node on their way to the file. At most one node of each depth has some at a
 * time. */
typedef struct merging {
    uint64_t node, done; /* and its splats in the file */
    unsigned used;       /* splats in the buffer */
    unsigned char *buffer;
} merging;

typedef struct bricker {
    const trip_brick_gaussians_params *p;
    trip_budget *budget;
    trip_workers *workers;
    trip_gaussian_writer *writer;
    trip_gaussian_encoder *encoder;
    const char *folder;
    size_t stride;
    trip_output spool; /* the splats as they come, then in the octree's order */
    uint64_t records, coarse, dropped, passed;
    double lo[3], hi[3];    /* bounds of the centres */
    int class_lo, class_hi; /* indices */
    trip_gaussian_sample sample;
    size_t sample_bytes;
    double typical_lo[3], typical_hi[3];
    trip_octree octree;
    trip_gaussian_levels *levels;
    trip_output ordered; /* the next spool */
    uint64_t numbered;   /* its splats */
    trip_output merged;  /* coarse splats by node */
    merging *mergings;   /* one for each depth of the octree */
    size_t mergings_bytes;
    unsigned depths, merging_room;       /* and splats of each buffer */
    uint64_t *merged_first;              /* of the octree's nodes: first splat in `merged` */
    uint64_t *counts;                    /* of their splats */
    uint64_t *groups;                    /* records by node and class; see group_of() */
    uint64_t counted_node, counted_left; /* leaf of the splat that is counted next */
    size_t groups_bytes;
    uint8_t *joined; /* class index of the group that a group joins */
    trip_file_gaussian_node *nodes;
    uint64_t *node_numbers; /* of the octree's nodes */
    uint64_t node_count;
    float *vectors; /* a sample of the coefficients */
    uint64_t vector_count, vector_room;
    trip_palette palette;
    double palette_error;
    trip_gaussian_tree trees[3];
    trip_gaussian_lists *lists;
    /* These belong to a node that does not fit into memory, and to its list. */
    int axis;
    const trip_listed_node *big; /* that is sorted on the disk */
    uint64_t leaf;               /* of the gathered splats */
    uint64_t leaf_left;          /* splats of the leaf that are not yet gathered */
    unsigned gathered, piece;    /* splats in the buffer, and the number that fills it */
} bricker;

static const char *source_name(const bricker *b)
{
    return b->p->source_name ? b->p->source_name : b->p->path;
}

static int fail_memory(const bricker *b)
{
    return trip_fail(TRIP_ERROR, "brick", b->p->path,
                     "bricking needs more memory than --memory allows: raise --memory");
}

static void tell_progress(bricker *b, uint64_t count)
{
    const uint64_t before = b->passed / PROGRESS_EVERY;
    b->passed += count;
    if (b->passed / PROGRESS_EVERY > before && b->p->progress)
        b->p->progress(b->p->progress_user, b->passed);
}

static int class_of(const trip_gaussian *g)
{
    return trip_gaussian_size_class(g->deviations) + CLASSES / 2;
}

static uint64_t class_count(const bricker *b)
{
    return (uint64_t)(b->class_hi - b->class_lo + 1);
}

static int make_output(bricker *b, trip_output *o)
{
    return trip_output_create(o,
                              &(trip_output_params){ .folder = b->folder,
                                                     .name = TRIP_SPOOL_NAME,
                                                     .buffer_bytes = SPOOL_BYTES,
                                                     .unnamed = true },
                              b->budget);
}

/* Makes a splat valid, as far as it has finite values. */
static bool repair(trip_gaussian *g, int degree)
{
    double length = 0;
    bool good = isfinite(g->opacity);
    for (int a = 0; a < 3; a++)
        good = good && fabs(g->centre[a]) <= TRIP_GAUSSIAN_FARTHEST && g->deviations[a] >= 0 &&
               (double)g->deviations[a] <= TRIP_GAUSSIAN_FARTHEST;
    for (int i = 0; i < 4; i++)
        length += (double)g->rotation[i] * (double)g->rotation[i];
    for (int k = 0; k < trip_sh_count(degree); k++)
        for (int c = 0; c < 3; c++)
            good = good && fabsf(g->sh[k][c]) <= TRIP_GAUSSIAN_COEFFICIENT_MAX;
    if (!good || !isfinite(length) || !(length > 0))
        return false;
    for (int i = 0; i < 4; i++)
        g->rotation[i] = (float)((double)g->rotation[i] / sqrt(length));
    g->opacity = fminf(fmaxf(g->opacity, 0), 1);
    return true;
}

static void add_point(bricker *b, const trip_gaussian *g)
{
    trip_gaussian_point *to = &b->sample.points[b->sample.count++];
    memcpy(to->centre, g->centre, sizeof to->centre);
    to->group = (uint64_t)class_of(g); /* set_groups_of_sample() adds the node */
}

static int take_room_of_sample(bricker *b, uint64_t records)
{
    b->sample_bytes = trip_gaussian_sample_room(records) * sizeof *b->sample.points;
    b->sample.points = trip_budget_take(b->budget, b->sample_bytes);
    return b->sample.points ? TRIP_OK : fail_memory(b);
}

static int spool_splat(bricker *b, trip_gaussian *g)
{
    const trip_spilled head = { .number = b->records };
    tell_progress(b, 1);
    if (!repair(g, b->p->degree)) {
        b->dropped++;
        return TRIP_OK;
    }
    for (int a = 0; a < 3; a++) {
        b->lo[a] = fmin(b->lo[a], g->centre[a]);
        b->hi[a] = fmax(b->hi[a], g->centre[a]);
    }
    const int class_index = class_of(g);
    if (b->p->octree && trip_gaussian_is_sampled(b->records, b->p->octree_records))
        add_point(b, g);
    b->class_lo = class_index < b->class_lo ? class_index : b->class_lo;
    b->class_hi = class_index > b->class_hi ? class_index : b->class_hi;
    b->records++;
    int status = trip_output_append(&b->spool, &head, sizeof head);
    if (status == TRIP_OK)
        status = trip_output_append(&b->spool, g, b->stride - sizeof head);
    return status == TRIP_OK && b->p->octree ? trip_gaussian_levels_count(b->levels, g) : status;
}

static int check_interrupted(const bricker *b)
{
    return trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "brick", source_name(b), "interrupted")
                              : TRIP_OK;
}

static int spool_batches(bricker *b, trip_gaussian *batch)
{
    size_t got = 1;
    int status = TRIP_OK;
    while (got > 0 && status == TRIP_OK) {
        status = b->p->source(b->p->source_user, batch, BATCH, &got);
        for (size_t i = 0; i < got && status == TRIP_OK; i++)
            status = spool_splat(b, &batch[i]);
        if (status == TRIP_OK)
            status = check_interrupted(b);
    }
    return status == TRIP_OK ? trip_output_flush(&b->spool) : status;
}

static int spool_all(bricker *b)
{
    const size_t bytes = BATCH * sizeof(trip_gaussian);
    trip_gaussian *batch = trip_budget_take(b->budget, bytes);
    int status = batch ? make_output(b, &b->spool) : fail_memory(b);
    if (status == TRIP_OK)
        status = spool_batches(b, batch);
    trip_budget_release(b->budget, batch, bytes);
    if (status == TRIP_OK && b->records == 0)
        return trip_fail(TRIP_ERROR, "brick", source_name(b), "contains no Gaussian to draw");
    if (status == TRIP_OK && b->dropped)
        trip_warn(source_name(b),
                  "%llu of %llu Gaussians have a value that is not finite, or a rotation of zero "
                  "length; they are left out",
                  (unsigned long long)b->dropped, (unsigned long long)(b->dropped + b->records));
    return status;
}

/* The encoder's room serves for reading too. */
static int take_sample(bricker *b)
{
    unsigned char *buffer = trip_gaussian_encoder_room(b->encoder);
    const uint64_t step = TRIP_GAUSSIAN_BRICK_RECORDS_MAX;
    int status = take_room_of_sample(b, b->records);
    for (uint64_t first = 0; first < b->records && status == TRIP_OK; first += step) {
        const uint64_t left = b->records - first, count = left < step ? left : step;
        status = trip_output_read(&b->spool, first * b->stride, buffer, count * b->stride);
        for (uint64_t i = 0; i < count && status == TRIP_OK; i++)
            if (trip_gaussian_is_sampled(first + i, b->records))
                add_point(b, (const void *)(buffer + i * b->stride + sizeof(trip_spilled)));
        if (status == TRIP_OK)
            status = check_interrupted(b);
    }
    return status;
}

/* Finds the bounds of the centres without the outer hundredth at each side. */
static int find_typical(bricker *b)
{
    const uint64_t count = b->sample.count;
    const size_t bytes = 2 * (count + 1) * sizeof(trip_key);
    trip_key *keys = trip_budget_take(b->budget, bytes);
    if (!keys)
        return fail_memory(b);
    for (int a = 0; a < 3 && count > 0; a++) {
        for (uint64_t i = 0; i < count; i++)
            keys[i] = (trip_key){ trip_key_of(b->sample.points[i].centre[a]), i };
        trip_key_sort(keys, keys + count + 1, count);
        b->typical_lo[a] = b->sample.points[keys[count / 100].number].centre[a];
        b->typical_hi[a] = b->sample.points[keys[count - 1 - count / 100].number].centre[a];
    }
    trip_budget_release(b->budget, keys, bytes);
    return TRIP_OK;
}

static int send_gathered(bricker *b)
{
    const uint64_t group = b->trees[b->axis].leaves[b->leaf].group;
    const trip_gaussian_piece piece = {
        .axis = b->axis,
        .node = b->node_numbers[group / class_count(b)],
        .size_class = (int)(group % class_count(b)) + b->class_lo - CLASSES / 2,
        .count = b->gathered,
    };
    b->gathered = 0;
    return trip_gaussian_encoder_send(b->encoder, &piece);
}

static int gather(void *user, const unsigned char *spilled)
{
    bricker *b = user;
    const uint64_t leaf = ((const trip_spilled *)(const void *)spilled)->group;
    if (b->gathered == 0) {
        if (b->leaf_left == 0)
            b->leaf_left = b->trees[b->axis].leaves[leaf].records;
        b->leaf = leaf;
        b->piece = trip_piece_count(b->leaf_left);
    }
    memcpy(trip_gaussian_encoder_room(b->encoder) + b->gathered++ * b->stride, spilled, b->stride);
    b->leaf_left--;
    return b->gathered == b->piece ? send_gathered(b) : TRIP_OK;
}

/* ---- levels ---- */

static uint64_t group_of(const bricker *b, uint64_t node, int class_index)
{
    return node * class_count(b) + (uint64_t)(class_index - b->class_lo);
}

static uint64_t group_count(const bricker *b)
{
    return b->octree.node_count * class_count(b);
}

/* Merged splats are at most about as large as the whole cube. Merging splats of one size in all
 * directions may give a smaller class. */
static void widen_classes(bricker *b)
{
    const float side[3] = { (float)(4 * b->octree.side) };
    const int most = trip_gaussian_size_class(side) + CLASSES / 2;
    b->class_hi = most > b->class_hi ? most : b->class_hi;
    b->class_lo -= b->class_lo > 0;
}

static void place_in_octree(void *user, const trip_gaussian *g, trip_spilled *head)
{
    const bricker *b = user;
    trip_octree_set_place(&b->octree, g->centre, head);
}

/* Counts a splat in the octree's order, and gives it a number in this order. */
static int count_splat(void *user, const unsigned char *spilled)
{
    bricker *b = user;
    const trip_spilled head = { .number = b->numbered++ };
    const trip_gaussian *g = (const void *)(spilled + sizeof(trip_spilled));
    tell_progress(b, 1);
    int status = trip_gaussian_levels_count(b->levels, g);
    if (status == TRIP_OK)
        status = trip_output_append(&b->ordered, &head, sizeof head);
    return status == TRIP_OK
               ? trip_output_append(&b->ordered, spilled + sizeof head, b->stride - sizeof head)
               : status;
}

/* Counts splats of the scene by node and class. They come in the octree's order. */
static void count_groups(bricker *b, const unsigned char *spilled, uint64_t count)
{
    for (uint64_t i = 0; i < count; i++, b->counted_left--) {
        while (b->counted_left == 0)
            if (!b->octree.nodes[++b->counted_node].children[0])
                b->counted_left = trip_gaussian_levels_records(b->levels, b->counted_node);
        const trip_gaussian *g = (const void *)(spilled + i * b->stride + sizeof(trip_spilled));
        b->groups[group_of(b, b->counted_node, class_of(g))]++;
    }
}

static int write_merging(bricker *b, merging *m)
{
    const size_t bytes = m->used * b->stride;
    if (!bytes)
        return TRIP_OK;
    const uint64_t at = b->merged_first[m->node] + m->done;
    m->done += m->used;
    m->used = 0;
    return trip_output_patch(&b->merged, at * b->stride, m->buffer, bytes);
}

static int emit_coarse(void *user, uint64_t node, const trip_gaussian *g)
{
    bricker *b = user;
    merging *m = &b->mergings[b->octree.nodes[node].depth];
    int status = TRIP_OK;
    if (m->used == b->merging_room || (m->used && m->node != node))
        status = write_merging(b, m);
    if (m->node != node)
        m->node = node, m->done = 0;
    unsigned char *to = m->buffer + m->used++ * b->stride;
    const trip_spilled head = { .number = b->records + b->coarse, .group = node };
    memcpy(to, &head, sizeof head);
    memcpy(to + sizeof head, g, b->stride - sizeof head);
    if (b->p->flags & TRIP_GAUSSIAN_HYPERLINES) /* the mean colour alone */
        memset(to + sizeof head + offsetof(trip_gaussian, sh) + sizeof g->sh[0], 0,
               b->stride - sizeof head - offsetof(trip_gaussian, sh) - sizeof g->sh[0]);
    b->groups[group_of(b, node, class_of(g))]++;
    if (trip_gaussian_is_sampled(b->coarse, b->records)) {
        trip_gaussian_point *point = &b->sample.points[b->sample.count++];
        memcpy(point->centre, g->centre, sizeof point->centre);
        point->group = group_of(b, node, class_of(g));
    }
    b->coarse++;
    return status;
}

/* Finds the places of the nodes' coarse splats. */
static int begin_merging(bricker *b)
{
    uint64_t all = 0;
    for (uint64_t i = 0; i < b->octree.node_count; i++)
        if (b->octree.nodes[i].depth >= b->depths)
            b->depths = b->octree.nodes[i].depth + 1;
    const uint64_t most = trip_budget_left_bytes(b->budget) / MERGED_PART / b->depths / b->stride;
    b->merging_room = most > MERGED_MAX ? MERGED_MAX : most < 1 ? 1 : (unsigned)most;
    const size_t each = sizeof *b->mergings + b->merging_room * b->stride;
    b->mergings_bytes = b->depths * each + b->octree.node_count * 2 * sizeof *b->counts;
    b->mergings = trip_budget_take(b->budget, b->mergings_bytes);
    if (!b->mergings)
        return fail_memory(b);
    b->merged_first = (void *)(b->mergings + b->depths);
    b->counts = b->merged_first + b->octree.node_count;
    unsigned char *buffers = (void *)(b->counts + b->octree.node_count);
    for (unsigned i = 0; i < b->depths; i++)
        b->mergings[i] =
            (merging){ .node = UINT64_MAX, .buffer = buffers + i * b->merging_room * b->stride };
    for (uint64_t i = 0; i < b->octree.node_count; i++) {
        b->merged_first[i] = all;
        b->counts[i] = trip_gaussian_levels_records(b->levels, i);
        all += b->octree.nodes[i].children[0] ? b->counts[i] : 0;
    }
    const int status = make_output(b, &b->merged);
    return status == TRIP_OK ? trip_output_reserve(&b->merged, all * b->stride) : status;
}

static int end_merging(bricker *b)
{
    int status = TRIP_OK;
    for (unsigned i = 0; i < b->depths && status == TRIP_OK; i++)
        status = write_merging(b, &b->mergings[i]);
    return status;
}

static int merge_splats(bricker *b)
{
    const uint64_t part = trip_budget_left_bytes(b->budget) / READ_PART / b->stride;
    const uint64_t step = part < READ_MIN ? READ_MIN : part > READ_MAX ? READ_MAX : part;
    unsigned char *buffer = trip_budget_take(b->budget, step * b->stride);
    int status = buffer ? TRIP_OK : fail_memory(b);
    for (uint64_t first = 0; first < b->records && status == TRIP_OK; first += step) {
        const uint64_t left = b->records - first, count = left < step ? left : step;
        status = trip_output_read(&b->spool, first * b->stride, buffer, count * b->stride);
        if (status == TRIP_OK)
            count_groups(b, buffer, count);
        if (status == TRIP_OK)
            status = trip_gaussian_levels_merge(b->levels, buffer + sizeof(trip_spilled), b->stride,
                                                count);
        if (status == TRIP_OK)
            status = check_interrupted(b);
        tell_progress(b, count);
    }
    trip_budget_release(b->budget, buffer, step * b->stride);
    return status;
}

/* Sorts the spool by the octree, and counts for the levels. */
static int order_spool(bricker *b)
{
    int status = make_output(b, &b->ordered);
    if (status == TRIP_OK)
        status = trip_gaussian_sort(&(trip_gaussian_sort_params){ .spool = &b->spool,
                                                                  .closes = &b->spool,
                                                                  .records = b->records,
                                                                  .degree = b->p->degree,
                                                                  .folder = b->folder,
                                                                  .path = b->p->path,
                                                                  .workers = b->workers,
                                                                  .place = place_in_octree,
                                                                  .emit = count_splat,
                                                                  .user = b },
                                    b->budget);
    if (status == TRIP_OK)
        status = trip_output_flush(&b->ordered);
    trip_output_close(&b->spool);
    b->spool = b->ordered;
    b->ordered = (trip_output){ .fd = -1 };
    return status;
}

/* Gives the points of the sample their groups, and makes room for points of coarse splats. */
static int set_groups_of_sample(bricker *b)
{
    const uint64_t coarse = trip_gaussian_levels_coarse(b->levels);
    const uint64_t room = b->sample.count + 2 +
                          (uint64_t)((double)trip_gaussian_sample_room(b->records) *
                                     ((double)coarse / (double)b->records));
    trip_gaussian_point *points = trip_budget_take(b->budget, room * sizeof *points);
    if (!points)
        return fail_memory(b);
    for (uint64_t i = 0; i < b->sample.count; i++) {
        const trip_octree_place p = trip_octree_place_of(&b->octree, b->sample.points[i].centre);
        points[i] = b->sample.points[i];
        points[i].group = group_of(b, trip_octree_leaf(&b->octree, &p, NULL), (int)points[i].group);
    }
    trip_budget_release(b->budget, b->sample.points, b->sample_bytes);
    b->sample.points = points;
    b->sample_bytes = room * sizeof *points;
    return TRIP_OK;
}

/* Makes the coarse splats. */
static int add_levels(bricker *b)
{
    int status = set_groups_of_sample(b);
    if (status == TRIP_OK)
        status = begin_merging(b);
    if (status == TRIP_OK)
        status = merge_splats(b);
    if (status == TRIP_OK)
        status = trip_gaussian_levels_end(b->levels);
    return status == TRIP_OK ? end_merging(b) : status;
}

/* Joins groups with few records to the group of the next larger class in their node. */
static void join_groups(bricker *b)
{
    for (uint64_t node = 0; node < b->octree.node_count; node++) {
        int next = -1;
        for (int c = b->class_hi; c >= b->class_lo; c--) {
            const uint64_t group = group_of(b, node, c);
            b->joined[group] = (uint8_t)c;
            if (!b->groups[group])
                continue;
            if (next < 0 || b->groups[group] >= GROUP_RECORDS) {
                next = c;
                continue;
            }
            b->groups[group_of(b, node, next)] += b->groups[group];
            b->groups[group] = 0;
            b->joined[group] = (uint8_t)next;
        }
    }
    for (uint64_t i = 0; i < b->sample.count; i++) {
        const uint64_t group = b->sample.points[i].group;
        b->sample.points[i].group = group_of(b, group / class_count(b), b->joined[group]);
    }
}

/* Adds a node of the octree and the nodes inside it to the table, as far as they have splats.
 * Returns the level of the highest one, or -1. */
static int add_nodes(bricker *b, uint64_t number)
{
    const trip_octree_node *from = &b->octree.nodes[number];
    const uint64_t made = b->node_count;
    const bool kept = trip_gaussian_levels_records(b->levels, number) > 0;
    int level = -1;
    if (kept) {
        b->node_numbers[number] = made;
        b->nodes[made].width = trip_gaussian_levels_width(b->levels, number);
        b->node_count++;
    }
    for (int i = 0; from->children[0] && i < 8; i++) {
        const int below = add_nodes(b, (uint64_t)from->children[i]);
        level = below > level ? below : level;
    }
    if (!kept)
        return level;
    b->nodes[made].nodes = b->node_count - made;
    b->nodes[made].level = (uint32_t)(level + 1);
    return level + 1;
}

static size_t nodes_bytes(const bricker *b)
{
    return b->octree.node_count * (sizeof *b->nodes + sizeof *b->node_numbers);
}

static int make_nodes(bricker *b)
{
    b->nodes = trip_budget_take(b->budget, nodes_bytes(b));
    if (!b->nodes)
        return fail_memory(b);
    b->node_numbers = (void *)(b->nodes + b->octree.node_count);
    add_nodes(b, 0);
    trip_gaussian_writer_set_nodes(b->writer, b->nodes, b->node_count);
    return TRIP_OK;
}

static int begin_levels(bricker *b)
{
    return trip_gaussian_levels_begin(&b->levels,
                                      &(trip_gaussian_levels_params){ .octree = &b->octree,
                                                                      .degree = b->p->degree,
                                                                      .workers = b->workers,
                                                                      .emit = emit_coarse,
                                                                      .user = b },
                                      b->budget)
               ? TRIP_OK
               : fail_memory(b);
}

static uint64_t leaf_aim(const bricker *b)
{
    return b->p->flags & TRIP_GAUSSIAN_CLOUD ? trip_octree_cloud_aim(b->records)
                                             : TRIP_OCTREE_LEAF_AIM;
}

/* Builds the octree from the spool. */
static int order(bricker *b)
{
    int status = take_sample(b);
    if (status == TRIP_OK && !trip_octree_build(&b->octree, &b->sample, b->records, leaf_aim(b),
                                                b->lo, b->hi, b->budget))
        status = fail_memory(b);
    if (status == TRIP_OK)
        status = begin_levels(b);
    return status == TRIP_OK ? order_spool(b) : status;
}

/* Receives the splats in the order of the octree. */
static int spool_ordered(bricker *b)
{
    b->octree = *b->p->octree;
    int status = take_room_of_sample(b, b->p->octree_records);
    if (status == TRIP_OK)
        status = begin_levels(b);
    return status == TRIP_OK ? spool_all(b) : status;
}

static int make_levels(bricker *b)
{
    widen_classes(b);
    b->groups_bytes = group_count(b) * (sizeof *b->groups + sizeof *b->joined);
    b->groups = trip_budget_take(b->budget, b->groups_bytes);
    b->joined = (void *)(b->groups + (b->groups ? group_count(b) : 0));
    b->counted_node = UINT64_MAX;
    int status = b->groups && trip_gaussian_levels_select(b->levels) ? TRIP_OK : fail_memory(b);
    if (status == TRIP_OK)
        status = add_levels(b);
    if (status == TRIP_OK)
        status = make_nodes(b);
    join_groups(b);
    trip_gaussian_levels_free(b->levels);
    b->levels = NULL;
    return status;
}

/* ---- palette ---- */

/* Takes vector_room of all splats, at even distances. */
static int take_vectors(bricker *b, uint64_t all)
{
    const size_t bytes = trip_palette_size(b->p->degree) * sizeof *b->vectors;
    const double share = (double)b->vector_room / (double)all;
    unsigned char *spilled = trip_gaussian_encoder_room(b->encoder);
    const trip_gaussian *g = (const void *)(spilled + sizeof(trip_spilled));
    int status = TRIP_OK;
    for (uint64_t i = 0; i < all && status == TRIP_OK; i++) {
        if (i % PROGRESS_EVERY == 0)
            status = check_interrupted(b);
        if (status < 0 || b->vector_count >= (uint64_t)((double)(i + 1) * share + 1e-6))
            continue;
        status = i < b->records ? trip_output_read(&b->spool, i * b->stride, spilled, b->stride)
                                : trip_output_read(&b->merged, (i - b->records) * b->stride,
                                                   spilled, b->stride);
        memcpy((char *)b->vectors + bytes * b->vector_count++, g->sh[1], bytes);
    }
    return status;
}

static unsigned find_entry(const void *user, const unsigned char *splat)
{
    const bricker *b = user;
    trip_gaussian g = { .opacity = 0 };
    memcpy(&g, splat,
           offsetof(trip_gaussian, sh) + (size_t)trip_sh_count(b->p->degree) * sizeof g.sh[0]);
    return trip_palette_find(&b->palette, g.sh);
}

/* Makes the palette, and gives it to the writer if its error is small or the caller wants it. */
static int make_palette(bricker *b)
{
    const trip_brick_harmonics how = b->p->harmonics;
    const uint64_t all = b->records + b->coarse;
    if (b->p->degree == 0 || how == TRIP_BRICK_HARMONICS_WHOLE)
        return TRIP_OK;
    b->vector_room = all < TRIP_PALETTE_SAMPLE_MAX ? all : TRIP_PALETTE_SAMPLE_MAX;
    const size_t bytes = b->vector_room * trip_palette_size(b->p->degree) * sizeof *b->vectors;
    b->vectors = trip_budget_take(b->budget, bytes);
    if (!b->vectors)
        return fail_memory(b);
    int status = take_vectors(b, all);
    if (status == TRIP_OK &&
        !trip_palette_build(&b->palette, b->vectors, b->vector_count, b->p->degree,
                            TRIP_GAUSSIAN_PALETTE_MAX, b->budget))
        status = fail_memory(b);
    trip_budget_release(b->budget, b->vectors, bytes);
    b->palette_error = b->palette.error;
    if (status == TRIP_OK &&
        (how == TRIP_BRICK_HARMONICS_PALETTE || b->palette.error < PALETTE_ERROR))
        trip_gaussian_writer_set_palette(b->writer,
                                         &(trip_gaussian_palette){ .entries = b->palette.entries,
                                                                   .count = b->palette.count,
                                                                   .find = find_entry,
                                                                   .user = b });
    else
        trip_palette_free(&b->palette);
    return status;
}

/* ---- lists ---- */

static void place_in_tree(void *user, const trip_gaussian *g, trip_spilled *head)
{
    const bricker *b = user;
    const uint64_t node = b->big->node, group = group_of(b, node, class_of(g));
    head->group =
        trip_gaussian_tree_leaf(&b->trees[b->axis], g->centre, group_of(b, node, b->joined[group]));
    head->at = g->centre[b->axis];
}

static void count_in_leaf(void *user, uint64_t leaf, uint64_t splats)
{
    bricker *b = user;
    atomic_fetch_add_explicit(&b->trees[b->axis].leaves[leaf].records, splats,
                              memory_order_relaxed);
}

/* Writes a node that does not fit into memory. */
static int write_big(bricker *b, const trip_listed_node *node)
{
    int status = TRIP_OK;
    b->big = node;
    for (b->axis = 0; b->axis < 3 && status == TRIP_OK; b->axis++) {
        b->leaf_left = 0;
        status = trip_gaussian_sort(&(trip_gaussian_sort_params){ .spool = node->from,
                                                                  .first = node->first,
                                                                  .records = node->count,
                                                                  .degree = b->p->degree,
                                                                  .folder = b->folder,
                                                                  .path = b->p->path,
                                                                  .workers = b->workers,
                                                                  .place = place_in_tree,
                                                                  .count = count_in_leaf,
                                                                  .emit = gather,
                                                                  .user = b },
                                    b->budget);
        if (status == TRIP_OK)
            status = trip_gaussian_encoder_finish(b->encoder);
    }
    return status;
}

/* Without enough memory, all nodes are sorted on the disk. */
static void begin_lists(bricker *b, uint64_t most)
{
    trip_gaussian_lists_begin(&b->lists,
                              &(trip_gaussian_lists_params){ .writer = b->writer,
                                                             .workers = b->workers,
                                                             .degree = b->p->degree,
                                                             .trees = b->trees,
                                                             .joined = b->joined,
                                                             .class_count = class_count(b),
                                                             .class_lo = b->class_lo },
                              most, b->budget);
}

static int write_node(bricker *b, const trip_listed_node *node, uint64_t most)
{
    int status = TRIP_OK;
    if (node->count <= trip_gaussian_lists_room(b->lists)) {
        status = trip_gaussian_lists_add(b->lists, node);
    } else {
        status = trip_gaussian_lists_finish(b->lists);
        trip_gaussian_lists_free(b->lists); /* the sort needs the memory */
        b->lists = NULL;
        if (status == TRIP_OK)
            status = write_big(b, node);
        begin_lists(b, most);
    }
    tell_progress(b, 3 * node->count);
    return status == TRIP_OK ? check_interrupted(b) : status;
}

static int write_lists(bricker *b)
{
    uint64_t most = 0, first = 0;
    int status = TRIP_OK;
    for (int axis = 0; axis < 3; axis++)
        if (!trip_gaussian_tree_build(&b->trees[axis], &b->sample, axis, b->groups, group_count(b),
                                      b->budget))
            return fail_memory(b);
    for (uint64_t i = 0; i < b->octree.node_count; i++)
        most = b->counts[i] > most ? b->counts[i] : most;
    begin_lists(b, most);
    for (uint64_t i = 0; i < b->octree.node_count && status == TRIP_OK; i++) {
        const bool leaf = !b->octree.nodes[i].children[0];
        const trip_listed_node node = { .node = i,
                                        .number = b->node_numbers[i],
                                        .from = leaf ? &b->spool : &b->merged,
                                        .first = leaf ? first : b->merged_first[i],
                                        .count = b->counts[i] };
        if (node.count)
            status = write_node(b, &node, most);
        first += leaf ? node.count : 0;
    }
    return status == TRIP_OK ? trip_gaussian_lists_finish(b->lists) : status;
}

static int run_bricker(bricker *b)
{
    const trip_brick_gaussians_params *p = b->p;
    int status = trip_workers_create(&b->workers, p->threads);
    if (status == TRIP_OK)
        status = trip_gaussian_writer_open(&b->writer,
                                           &(trip_gaussian_writer_params){ .path = p->path,
                                                                           .replace = p->replace,
                                                                           .degree = p->degree,
                                                                           .flags = p->flags,
                                                                           .text = p->text },
                                           b->budget);
    if (status < 0)
        return status;
    b->folder = p->temporary ? p->temporary : trip_gaussian_writer_folder(b->writer);
    if (!trip_gaussian_encoder_create(&b->encoder, b->writer, b->workers, p->degree, b->budget))
        return fail_memory(b);
    status = p->octree ? spool_ordered(b) : spool_all(b);
    if (status == TRIP_OK && !p->octree)
        status = order(b);
    if (status == TRIP_OK)
        status = find_typical(b);
    if (status == TRIP_OK)
        status = make_levels(b);
    if (status == TRIP_OK)
        status = make_palette(b);
    if (status == TRIP_OK)
        status = write_lists(b);
    if (status < 0)
        return status;
    return trip_gaussian_writer_finish(b->writer, b->typical_lo, b->typical_hi);
}

static void free_bricker(bricker *b)
{
    trip_gaussian_encoder_free(b->encoder);
    trip_gaussian_writer_close(b->writer);
    trip_output_close(&b->spool);
    trip_output_close(&b->ordered);
    trip_output_close(&b->merged);
    trip_gaussian_levels_free(b->levels);
    if (b->sample.points)
        trip_budget_release(b->budget, b->sample.points, b->sample_bytes);
    trip_gaussian_lists_free(b->lists);
    for (int axis = 0; axis < 3; axis++)
        trip_gaussian_tree_free(&b->trees[axis]);
    if (b->mergings)
        trip_budget_release(b->budget, b->mergings, b->mergings_bytes);
    if (b->groups)
        trip_budget_release(b->budget, b->groups, b->groups_bytes);
    if (b->nodes)
        trip_budget_release(b->budget, b->nodes, nodes_bytes(b));
    if (!b->p->octree)
        trip_octree_free(&b->octree);
    trip_palette_free(&b->palette);
    trip_workers_destroy(b->workers);
    free(b);
}

int trip_brick_gaussians(const trip_brick_gaussians_params *params, trip_budget *budget,
                         trip_brick_gaussians_result *result)
{
    bricker *b = calloc(1, sizeof *b);
    if (!b)
        return trip_fail(TRIP_ERROR, "brick", params->path, "out of memory");
    b->p = params;
    b->budget = budget;
    b->stride = trip_spilled_bytes(params->degree);
    b->spool.fd = b->ordered.fd = b->merged.fd = -1;
    b->class_lo = CLASSES;
    for (int a = 0; a < 3; a++)
        b->lo[a] = INFINITY, b->hi[a] = -INFINITY;
    const int status = run_bricker(b);
    if (result)
        *result = (trip_brick_gaussians_result){ .records = b->records,
                                                 .coarse = b->coarse,
                                                 .palette = b->palette.count,
                                                 .palette_error = b->palette_error,
                                                 .dropped = b->dropped };
    free_bricker(b);
    return status;
}
