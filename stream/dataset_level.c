#include "dataset_level.h"

#include <limits.h>
#include <string.h>

#include "report.h"

unsigned trip_dataset_levels(const trip_dataset *d, trip_kind kind)
{
    unsigned level = 0;
    while (level < TRIP_DATASET_LEVELS_MAX && trip_dataset_find(d, 0, level + 1, kind) &&
           trip_dataset_find(d, 1, level + 1, kind) && trip_dataset_find(d, 2, level + 1, kind))
        level++;
    return level;
}

/* Makes the list a list of level 0, and its grid the grid of the data set. */
static void put_first(trip_dataset *d, trip_list *list)
{
    list->level = 0;
    list->sheet_first = 0;
    list->sheet_step = 1;
    d->index_to_world = list->index_to_world;
    memcpy(d->header.index_to_world, list->index_to_world.m, sizeof d->header.index_to_world);
    for (int a = 0; a < 3; a++)
        d->header.dims[a] = (uint64_t)list->dims[a];
}

int trip_dataset_level_open(trip_dataset **out, const trip_dataset *d, unsigned level)
{
    const size_t lists = d->list_count * sizeof *d->lists;
    trip_dataset *at = *out = trip_budget_take(d->budget, sizeof *at + lists);
    if (!at)
        return trip_fail(TRIP_ERROR, "open", d->path, "no memory for a level; raise --memory");
    *at = *d;
    at->lists = (trip_list *)(void *)(at + 1);
    memcpy(at->lists, d->lists, lists);
    for (unsigned i = 0; i < at->list_count; i++) {
        trip_list *list = &at->lists[i];
        if (list->level == level && list->kind == TRIP_KIND_VALUES)
            put_first(at, list);
        else
            list->level = UINT_MAX; /* no search finds this level */
    }
    return TRIP_OK;
}

void trip_dataset_level_close(trip_dataset *d)
{
    if (d)
        trip_budget_release(d->budget, d, sizeof *d + d->list_count * sizeof *d->lists);
}
