#include "plan_around.h"

#include "dataset_normals.h"
#include "report.h"

/* Returns the index of the first slab at or after a number. */
static uint64_t find_slab(const trip_list *list, int64_t slab)
{
    uint64_t lo = 0, hi = list->slab_count;
    while (lo < hi) {
        const uint64_t middle = lo + (hi - lo) / 2;
        if (list->slabs[middle].slab < slab)
            lo = middle + 1;
        else
            hi = middle;
    }
    return lo;
}

/* Adds the brick at a position to the selection, if the list has one. */
static void add_brick(trip_selection *to, int64_t slab, int64_t tile_u, int64_t tile_v)
{
    const trip_list *list = to->list;
    const uint64_t at = slab < 0 ? list->slab_count : find_slab(list, slab);
    if (at == list->slab_count || list->slabs[at].slab != slab || tile_u < 0 || tile_v < 0)
        return;
    const uint64_t wanted = trip_morton((uint32_t)tile_u, (uint32_t)tile_v);
    uint64_t lo = list->slabs[at].first_brick, hi = lo + list->slabs[at].brick_count;
    const uint64_t end = hi;
    while (lo < hi) {
        const uint64_t middle = lo + (hi - lo) / 2;
        if (trip_morton(list->bricks[middle].tile_u, list->bricks[middle].tile_v) < wanted)
            lo = middle + 1;
        else
            hi = middle;
    }
    if (lo < end && list->bricks[lo].tile_u == tile_u && list->bricks[lo].tile_v == tile_v)
        trip_selection_add(to, lo);
}

/* Adds the bricks with voxels beside a brick's voxels. */
static void add_around(trip_selection *to, const trip_file_header *h, const trip_file_brick *b,
                       int64_t slab)
{
    const unsigned last = (1u << h->tile_log2) - 1;
    const int64_t u = b->tile_u, v = b->tile_v;
    add_brick(to, slab, u, v);
    if (b->u_min == 0)
        add_brick(to, slab, u - 1, v);
    if (b->u_max == last)
        add_brick(to, slab, u + 1, v);
    if (b->v_min == 0)
        add_brick(to, slab, u, v - 1);
    if (b->v_max == last)
        add_brick(to, slab, u, v + 1);
    if (b->sheet_min == 0)
        add_brick(to, slab - 1, u, v);
    if (b->sheet_max + 1u == h->slab_sheets)
        add_brick(to, slab + 1, u, v);
}

/* Adds the bricks around a selection to the selection of a list of the same level. */
static void add_selection(trip_selection *to, const trip_selection *drawn)
{
    const trip_file_header *h = &drawn->data->header;
    const trip_list *list = drawn->list;
    for (uint64_t s = 0; s < list->slab_count; s++) {
        const trip_file_slab *slab = &list->slabs[s];
        for (uint64_t b = slab->first_brick; b < slab->first_brick + slab->brick_count; b++)
            if (trip_selection_has(drawn, b))
                add_around(to, h, &list->bricks[b], slab->slab);
    }
}

/* Counts the blocks of the selected bricks that the pass does not draw. */
static void count_bytes(trip_plan_around *a, const trip_selection *around,
                        const trip_selection *drawn)
{
    const uint32_t sheets = around->data->header.slab_sheets;
    const trip_list *list = around->list;
    for (uint64_t b = 0; b < list->brick_count; b++) {
        if (!trip_selection_has(around, b) || (drawn && trip_selection_has(drawn, b)))
            continue;
        for (uint32_t s = 0; s < sheets; s++)
            a->bytes += 8 * (uint64_t)list->runs[b * sheets + s].words;
    }
}

/* Makes the selection of a list, if the pass draws its level. */
static int add_list(trip_plan_around *a, const trip_pass *drawn, trip_pass *around,
                    const trip_list *list, trip_budget *budget)
{
    const trip_selection *own = NULL;
    trip_selection *to = &a->selections[a->count];
    int64_t first = INT64_MAX, last = -1;
    for (unsigned i = 0; i < drawn->selection_count; i++) {
        const trip_selection *s = &drawn->selections[i];
        if (s->list == list)
            own = s;
        if (s->list->level != list->level)
            continue;
        first = s->sheet_first < first ? s->sheet_first : first;
        last = s->sheet_last > last ? s->sheet_last : last;
    }
    if (last < 0)
        return 0;
    int status = trip_selection_create(to, drawn->selections->data, list, drawn->descending,
                                       first - 1, last < INT32_MAX ? last + 1 : last, budget);
    if (status)
        return status;
    to->ahead = 1;
    for (unsigned i = 0; i < drawn->selection_count; i++)
        if (drawn->selections[i].list->level == list->level)
            add_selection(to, &drawn->selections[i]);
    count_bytes(a, to, own);
    a->count++;
    around->selection_count++;
    return 0;
}

/* Whether a pass reads a list: for its values, or because it is drawn. */
static bool is_read(const trip_dataset *data, const trip_list *list, int axis)
{
    return list->axis == axis && list->records > 0 &&
           (trip_kind_of(list->kind)->splatted || trip_dataset_has_gradients_of(data, list));
}

int trip_plan_around_create(trip_plan_around *a, unsigned lists, trip_budget *budget)
{
    a->room = 2 * lists;
    a->selections = trip_budget_take(budget, a->room * sizeof *a->selections);
    if (a->selections)
        return 0;
    return trip_fail(TRIP_ERROR, "render", "plan",
                     "%u lists do not fit the memory given; raise --memory", lists);
}

int trip_plan_around_add(trip_plan_around *a, const trip_pass *drawn, trip_pass *around,
                         trip_budget *budget)
{
    const trip_dataset *data = drawn->selections->data;
    const int axis = drawn->selections->list->axis;
    int status = 0;
    *around =
        (trip_pass){ .selections = &a->selections[a->count], .descending = drawn->descending };
    for (unsigned i = 0; i < data->list_count && !status; i++)
        if (is_read(data, &data->lists[i], axis))
            status = add_list(a, drawn, around, &data->lists[i], budget);
    return status;
}

void trip_plan_around_release(trip_plan_around *a, trip_budget *budget)
{
    for (unsigned i = 0; i < a->count; i++)
        trip_selection_destroy(&a->selections[i], budget);
    trip_budget_release(budget, a->selections, a->selections ? a->room * sizeof *a->selections : 0);
    *a = (trip_plan_around){ 0 };
}
