#include "sheet_room.h"

#include <string.h>

#include "dataset_normals.h"
#include "report.h"

typedef struct slab_sum {
    uint64_t tiles[64], squares[64], runs[64], block_bytes[64]; /* by sheet of a slab */
} slab_sum;

static void add_slab(slab_sum *sum, const trip_dataset *d, const trip_list *list,
                     const trip_file_slab *slab)
{
    const uint32_t sheets = d->header.slab_sheets;
    const uint32_t squares = 1u << 2 * (d->header.tile_log2 - 3);
    const bool source = trip_dataset_has_gradients_of(d, list);
    const bool splatted = trip_kind_of(list->kind)->splatted;
    for (uint64_t b = slab->first_brick; b < slab->first_brick + slab->brick_count; b++)
        for (uint32_t s = 0; s < sheets; s++) {
            const trip_file_run *run = &list->runs[b * sheets + s];
            if (run->records > 0 && source) {
                sum->tiles[s]++;
                sum->squares[s] += run->records < squares ? run->records : squares;
            }
            if (run->records > 0 && splatted) {
                sum->runs[s]++;
                sum->block_bytes[s] += 8 * (uint64_t)run->words;
            }
        }
}

static uint64_t larger(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

/* Enlarges the room to the largest sheet of the lists of a level along an axis. `at` has room for a
 * number per list. */
static void fit_sheets(trip_sheet_room *to, const trip_dataset *d, unsigned number, int axis,
                       uint64_t *at)
{
    memset(at, 0, d->list_count * sizeof *at);
    for (;;) {
        uint32_t slab = UINT32_MAX;
        slab_sum sum = { 0 };
        for (unsigned i = 0; i < d->list_count; i++) {
            const trip_list *list = &d->lists[i];
            if (list->level == number && list->axis == axis && at[i] < list->slab_count &&
                list->slabs[at[i]].slab < slab)
                slab = list->slabs[at[i]].slab;
        }
        if (slab == UINT32_MAX)
            return;
        for (unsigned i = 0; i < d->list_count; i++) {
            const trip_list *list = &d->lists[i];
            if (list->level == number && list->axis == axis && at[i] < list->slab_count &&
                list->slabs[at[i]].slab == slab)
                add_slab(&sum, d, list, &list->slabs[at[i]++]);
        }
        for (uint32_t s = 0; s < d->header.slab_sheets; s++) {
            to->tiles = larger(to->tiles, sum.tiles[s]);
            to->squares = larger(to->squares, sum.squares[s]);
            to->runs = larger(to->runs, sum.runs[s]);
            to->block_bytes = larger(to->block_bytes, sum.block_bytes[s]);
        }
    }
}

static bool has_splats(const trip_dataset *d, unsigned number)
{
    bool some = false;
    for (unsigned i = 0; i < d->list_count; i++)
        some |= d->lists[i].level == number && trip_kind_of(d->lists[i].kind)->splatted &&
                d->lists[i].records > 0;
    return some;
}

int trip_sheet_rooms_find(const trip_dataset *d, trip_sheet_room rooms[TRIP_SHEET_LEVELS],
                          trip_budget *budget)
{
    const size_t bytes = d->list_count * sizeof(uint64_t);
    uint64_t *at = trip_budget_take(budget, bytes);
    if (!at)
        return trip_fail(TRIP_ERROR, "read", d->path, "no memory for its lists; raise --memory");
    for (unsigned i = 0; i < TRIP_SHEET_LEVELS; i++) {
        rooms[i] = (trip_sheet_room){ .used = has_splats(d, i) };
        for (int axis = 0; axis < 3 && rooms[i].used; axis++)
            fit_sheets(&rooms[i], d, i, axis, at);
    }
    trip_budget_release(budget, at, bytes);
    return TRIP_OK;
}

void *trip_sheet_room_carve(unsigned char *base, size_t *used, uint64_t count, size_t each_bytes)
{
    size_t at = *used;
    *used += (size_t)(count * each_bytes + 63) & ~(size_t)63;
    return base ? base + at : NULL;
}
