#include "dataset_join.h"

#include <string.h>
#include <xxhash.h>

#include "report.h"

static bool has_same_coordinates(const trip_dataset *a, const trip_dataset *b)
{
    bool same = true;
    for (int axis = 0; axis < 3 && same; axis++) {
        const double *x = a->coordinates.along[axis], *y = b->coordinates.along[axis];
        same = !x == !y && (!x || !memcmp(x, y, a->header.dims[axis] * sizeof *x));
    }
    return same;
}

/* Returns how a data set differs from the first, or NULL if they can be joined. */
static const char *find_difference(const trip_dataset *first, const trip_dataset *d)
{
    const trip_file_header *a = &first->header, *b = &d->header;
    if (memcmp(a->dims, b->dims, sizeof a->dims) != 0 ||
        memcmp(a->index_to_world, b->index_to_world, sizeof a->index_to_world) != 0 ||
        !has_same_coordinates(first, d))
        return "has a different grid";
    if (!trip_codes_equal(&first->codes, &d->codes) || a->code_bytes != b->code_bytes)
        return "has a different scale of values";
    const bool stored = a->normal_bytes && b->normal_bytes;
    if (stored && (a->normal_bytes != b->normal_bytes || a->gradient_full != b->gradient_full ||
                   memcmp(a->gradient_step, b->gradient_step, sizeof a->gradient_step) != 0))
        return "has different normals";
    if (a->tile_log2 != b->tile_log2 || a->slab_sheets != b->slab_sheets ||
        a->page_log2 != b->page_log2)
        return "has different tiles, slabs or pages";
    return NULL;
}

/* Counts the lists of all parts at level 0. */
static unsigned count_lists(trip_dataset *const *parts, unsigned count)
{
    unsigned lists = 0;
    for (unsigned p = 0; p < count; p++)
        for (unsigned i = 0; i < parts[p]->list_count; i++)
            lists += parts[p]->lists[i].level == 0;
    return lists;
}

static bool meet(unsigned a_min, unsigned a_max, unsigned b_min, unsigned b_max)
{
    return a_min <= b_max && b_min <= a_max;
}

/* Whether bricks in the same position may have a voxel in common, which would have one value in
 * both. */
static bool bricks_meet(const trip_file_brick *a, const trip_file_brick *b)
{
    return meet(a->u_min, a->u_max, b->u_min, b->u_max) &&
           meet(a->v_min, a->v_max, b->v_min, b->v_max) &&
           meet(a->sheet_min, a->sheet_max, b->sheet_min, b->sheet_max) &&
           meet(a->code_min, a->code_max, b->code_min, b->code_max);
}

/* Whether slabs of the same number have bricks that meet. Bricks are in the order of their
 * positions. */
static bool slabs_meet(const trip_list *a, const trip_file_slab *in_a, const trip_list *b,
                       const trip_file_slab *in_b)
{
    const trip_file_brick *p = a->bricks + in_a->first_brick, *p_end = p + in_a->brick_count;
    const trip_file_brick *q = b->bricks + in_b->first_brick, *q_end = q + in_b->brick_count;
    while (p < p_end && q < q_end) {
        const uint64_t at_p = trip_morton(p->tile_u, p->tile_v);
        const uint64_t at_q = trip_morton(q->tile_u, q->tile_v);
        if (at_p == at_q && bricks_meet(p, q))
            return true;
        p += at_p <= at_q;
        q += at_q <= at_p;
    }
    return false;
}

/* Whether two data sets on one grid may keep the same voxel, by the bounds of their bricks. Always
 * false for boxes of the grid that do not overlap. */
static bool overlap(const trip_dataset *first, const trip_dataset *second)
{
    const trip_list *a = trip_dataset_find(first, 0, 0, TRIP_KIND_VOXELS);
    const trip_list *b = trip_dataset_find(second, 0, 0, TRIP_KIND_VOXELS);
    for (uint64_t i = 0, j = 0; a && b && i < a->slab_count && j < b->slab_count;) {
        const trip_file_slab *p = &a->slabs[i], *q = &b->slabs[j];
        if (p->slab == q->slab && slabs_meet(a, p, b, q))
            return true;
        i += p->slab <= q->slab;
        j += q->slab <= p->slab;
    }
    return false;
}

/* Checks the last part against the earlier parts, which were checked against each other before. */
static int check_overlap(trip_dataset *const *parts, unsigned count)
{
    const trip_dataset *last = parts[count - 1];
    for (unsigned p = 0; p + 1 < count; p++)
        if (overlap(parts[p], last))
            return trip_fail(TRIP_ERROR, "open", last->path,
                             "overlaps %s, so some voxels would be drawn twice; draw only regions "
                             "without common voxels together",
                             parts[p]->path);
    return TRIP_OK;
}

static int check(trip_dataset *const *parts, unsigned count)
{
    for (unsigned p = 1; p < count; p++) {
        const char *why = find_difference(parts[0], parts[p]);
        if (why)
            return trip_fail(TRIP_ERROR, "open", parts[p]->path, "%s than %s; " TRIP_JOIN_ADVICE,
                             why, parts[0]->path);
    }
    if (count_lists(parts, count) > TRIP_LISTS_MAX)
        return trip_fail(
            TRIP_ERROR, "open", parts[count - 1]->path,
            "brings the number of lists above the maximum of %d; draw fewer data sets together",
            TRIP_LISTS_MAX);
    return check_overlap(parts, count);
}

static void add_lists(trip_dataset *d, const trip_dataset *part, unsigned number)
{
    for (unsigned i = 0; i < part->list_count; i++) {
        if (part->lists[i].level > 0)
            continue;
        trip_list *list = &d->lists[d->list_count];
        *list = part->lists[i];
        list->index = d->list_count++;
        list->part = number;
    }
}

/* Updates the common header. If a part has no halo, values cannot be interpolated at its border. */
static void add_header(trip_dataset *d, const trip_dataset *part)
{
    trip_file_header *h = &d->header;
    const trip_file_header *of = &part->header;
    const uint64_t sums[2] = { h->header_checksum, of->header_checksum };
    h->header_checksum = XXH64(sums, sizeof sums, 0);
    h->value_min = h->value_min < of->value_min ? h->value_min : of->value_min;
    h->value_max = h->value_max > of->value_max ? h->value_max : of->value_max;
    h->voxels = h->voxels > of->voxels ? h->voxels : of->voxels;
    h->halo = h->halo && of->halo ? h->halo + of->halo : 0;
    h->kept += of->kept;
    h->index_bytes += of->index_bytes;
    d->bytes += part->bytes;
}

/* Level 0 has no deviations. Hides the normals of all parts, unless each part stores normals. */
static void hide_planes(trip_dataset *d, trip_dataset *const *parts, unsigned count)
{
    bool all = true;
    d->header.planes &= ~(1u << TRIP_PLANE_DEVIATIONS);
    for (unsigned p = 0; p < count; p++)
        all = all && parts[p]->header.normal_bytes > 0;
    if (all)
        return;
    d->header.planes &= ~(1u << TRIP_PLANE_NORMALS);
    d->header.normal_bytes = 0;
    d->header.gradient_full = 0;
    for (unsigned i = 0; i < d->list_count; i++)
        d->lists[i].planes &= ~(1u << TRIP_PLANE_NORMALS);
}

int trip_dataset_join(trip_dataset **out, trip_dataset *const *parts, unsigned count,
                      trip_budget *budget)
{
    *out = NULL;
    int status = check(parts, count);
    if (status < 0)
        return status;
    const unsigned lists = count_lists(parts, count);
    trip_dataset *d = trip_budget_take(budget, sizeof *d + lists * sizeof *d->lists);
    if (!d)
        return trip_fail(TRIP_ERROR, "open", parts[count - 1]->path,
                         "no memory for the %u lists of all data sets; raise --memory", lists);
    *d = *parts[0];
    d->budget = budget;
    d->lists = (trip_list *)(void *)(d + 1);
    d->list_count = 0;
    for (unsigned p = 0; p < count; p++) {
        add_lists(d, parts[p], p);
        if (p > 0)
            add_header(d, parts[p]);
    }
    hide_planes(d, parts, count);
    *out = d;
    return TRIP_OK;
}

void trip_dataset_join_close(trip_dataset *d)
{
    if (d)
        trip_budget_release(d->budget, d, sizeof *d + d->list_count * sizeof *d->lists);
}
