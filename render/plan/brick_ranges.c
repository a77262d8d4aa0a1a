#include "brick_ranges.h"

#include <math.h>
#include <string.h>

#include "blurred_function.h"
#include "field.h"

/* Maximum number of tiles: 4 bytes each, for a few slabs. */
#define TILES_MAX (INT64_C(1) << 24)

static const trip_code_range nothing = { 65535, 0 };

static bool is_of(const trip_brick_ranges *r, const trip_list *list)
{
    return list->axis == r->axis && list->level == 0;
}

static trip_code_range both(trip_code_range a, trip_code_range b)
{
    return (trip_code_range){ a.min < b.min ? a.min : b.min, a.max > b.max ? a.max : b.max };
}

/* Finds the range of tiles with bricks, grown by one tile. */
static void find_tiles(trip_brick_ranges *r)
{
    int64_t lo[2] = { INT64_MAX, INT64_MAX }, hi[2] = { -1, -1 };
    for (unsigned i = 0; i < r->data->list_count; i++) {
        const trip_list *list = &r->data->lists[i];
        for (uint64_t k = 0; is_of(r, list) && k < list->brick_count; k++) {
            const int64_t at[2] = { list->bricks[k].tile_u, list->bricks[k].tile_v };
            for (int a = 0; a < 2; a++) {
                lo[a] = at[a] < lo[a] ? at[a] : lo[a];
                hi[a] = at[a] > hi[a] ? at[a] : hi[a];
            }
        }
    }
    if (hi[0] < 0)
        return;
    r->first_u = lo[0] - 1;
    r->first_v = lo[1] - 1;
    r->across = hi[0] - lo[0] + 3;
    r->down = hi[1] - lo[1] + 3;
}

void trip_brick_ranges_create(trip_brick_ranges *r, const trip_dataset *data,
                              const trip_draw_codes *draw, int axis, trip_kernel kernel, bool blurs,
                              trip_budget *budget)
{
    int sheets = (int)data->header.slab_sheets;
    *r = (trip_brick_ranges){ .data = data,
                              .draw = draw,
                              .axis = axis,
                              .kernel = kernel,
                              .reach = (trip_sheet_reach(kernel) + sheets - 1) / sheets,
                              .middle = INT64_MIN / 2,
                              .budget = budget };
    r->slabs = 2 * r->reach + 1;
    find_tiles(r);
    if (r->across == 0 || r->down > TILES_MAX / r->across)
        return;
    size_t tiles = (size_t)(r->across * r->down);
    r->bytes = (size_t)r->slabs * tiles * (sizeof *r->tiles[0] + (blurs ? 1 : 0));
    trip_code_range *memory = trip_budget_take(budget, r->bytes);
    for (int i = 0; i < r->slabs && memory; i++)
        r->tiles[i] = memory + (size_t)i * tiles;
    uint8_t *deviations = (uint8_t *)(memory ? memory + (size_t)r->slabs * tiles : NULL);
    for (int i = 0; i < r->slabs && memory && blurs; i++)
        r->deviations[i] = deviations + (size_t)i * tiles;
}

void trip_brick_ranges_destroy(trip_brick_ranges *r)
{
    trip_code_range *memory = r->tiles[0];
    for (int i = 1; i < r->slabs; i++)
        memory = r->tiles[i] < memory ? r->tiles[i] : memory;
    trip_budget_release(r->budget, memory, r->bytes);
    r->tiles[0] = NULL;
}

static int64_t position_of(const trip_brick_ranges *r, int64_t u, int64_t v)
{
    return (v - r->first_v) * r->across + u - r->first_u;
}

static void fill_from(trip_brick_ranges *r, int layer, const trip_list *list, int64_t slab)
{
    uint64_t lo = 0, hi = list->slab_count;
    while (lo < hi) {
        uint64_t middle = (lo + hi) / 2;
        if (list->slabs[middle].slab < slab)
            lo = middle + 1;
        else
            hi = middle;
    }
    if (lo == list->slab_count || list->slabs[lo].slab != slab)
        return;
    const trip_file_slab *s = &list->slabs[lo];
    for (uint64_t k = s->first_brick; k < s->first_brick + s->brick_count; k++) {
        const trip_file_brick *b = &list->bricks[k];
        const int64_t at = position_of(r, b->tile_u, b->tile_v);
        trip_code_range *tile = &r->tiles[layer][at];
        if (r->deviations[layer] && b->deviation_max > r->deviations[layer][at])
            r->deviations[layer][at] = b->deviation_max;
        *tile = both(*tile, trip_draw_codes_range(r->draw, b->code_min, b->code_max));
    }
}

static void fill(trip_brick_ranges *r, int layer, int64_t slab)
{
    for (int64_t i = 0; i < r->across * r->down; i++)
        r->tiles[layer][i] = nothing;
    if (r->deviations[layer])
        memset(r->deviations[layer], 0, (size_t)(r->across * r->down));
    for (unsigned i = 0; i < r->data->list_count; i++)
        if (is_of(r, &r->data->lists[i]))
            fill_from(r, layer, &r->data->lists[i], slab);
}

/* Loads a slab and its neighbours; stepping to the next slab loads only one more. */
static void move_to(trip_brick_ranges *r, int64_t slab)
{
    if (slab == r->middle)
        return;
    if (slab == r->middle + 1) {
        trip_code_range *first = r->tiles[0];
        memmove(r->tiles, r->tiles + 1, (size_t)(r->slabs - 1) * sizeof *r->tiles);
        r->tiles[r->slabs - 1] = first;
        uint8_t *deviations = r->deviations[0];
        memmove(r->deviations, r->deviations + 1, (size_t)(r->slabs - 1) * sizeof *r->deviations);
        r->deviations[r->slabs - 1] = deviations;
        fill(r, r->slabs - 1, slab + r->reach);
    } else {
        for (int i = 0; i < r->slabs; i++)
            fill(r, i, slab - r->reach + i);
    }
    r->middle = slab;
}

/* Widens the range by the overshoot of the interpolation kernel. */
static trip_code_range widened(trip_kernel kernel, trip_code_range range)
{
    double bounds[2];
    if (range.min > range.max)
        return range;
    trip_field_code_bounds(kernel, range.min, range.max, bounds);
    return (trip_code_range){ (uint16_t)fmax(0, floor(bounds[0])),
                              (uint16_t)fmin(65535, ceil(bounds[1])) };
}

/* The weights of kernels of 64 voxels may enlarge deviations, and a map of codes may enlarge them
 * anywhere. */
trip_code_range trip_brick_range_blurred(trip_kernel kernel, const trip_draw_codes *draw,
                                         trip_code_range range, unsigned d)
{
    const bool bounded = !trip_kernel_is_wide(kernel) && !draw->of_stored;
    const double reach = ceil(trip_blurred_reach(bounded ? d : TRIP_DEVIATION_MAX));
    if (d == 0 || range.min > range.max)
        return range;
    return (trip_code_range){ (uint16_t)fmax(0, range.min - reach),
                              (uint16_t)fmin(65535, range.max + reach) };
}

trip_code_range trip_brick_ranges_about(trip_brick_ranges *r, uint32_t slab,
                                        const trip_file_brick *brick)
{
    trip_code_range range = nothing;
    unsigned deviation = 0;
    if (!r->tiles[0])
        return (trip_code_range){ 0, 65535 };
    move_to(r, slab);
    for (int layer = 0; layer < r->slabs; layer++)
        for (int dv = -1; dv <= 1; dv++)
            for (int du = -1; du <= 1; du++) {
                const int64_t at =
                    position_of(r, (int64_t)brick->tile_u + du, (int64_t)brick->tile_v + dv);
                range = both(range, r->tiles[layer][at]);
                if (r->deviations[layer] && r->deviations[layer][at] > deviation)
                    deviation = r->deviations[layer][at];
            }
    return trip_brick_range_blurred(r->kernel, r->draw, widened(r->kernel, range), deviation);
}
