#include "slab.h"

#include "clones.h"
#include "report.h"

#include <stdbool.h>
#include <string.h>

void trip_slab_init(trip_slab *s, unsigned sheets, trip_budget *budget)
{
    *s = (trip_slab){ .budget = budget, .sheets = sheets };
}

static void release(trip_slab *s)
{
    size_t brick_bytes = s->room * sizeof *s->bricks;
    size_t run_bytes = s->room * s->sheets * sizeof *s->runs;
    trip_budget_release(s->budget, s->bricks, brick_bytes);
    trip_budget_release(s->budget, s->bricks_spare, brick_bytes);
    trip_budget_release(s->budget, s->runs, run_bytes);
    trip_budget_release(s->budget, s->runs_spare, run_bytes);
}

void trip_slab_free(trip_slab *s)
{
    if (s->budget)
        release(s);
    *s = (trip_slab){ 0 };
}

static int grow(trip_slab *s)
{
    trip_slab n = *s;
    n.room = s->room ? 2 * s->room : 512;
    size_t brick_bytes = n.room * sizeof *n.bricks;
    size_t run_bytes = n.room * n.sheets * sizeof *n.runs;
    n.bricks = trip_budget_take(n.budget, brick_bytes);
    n.bricks_spare = trip_budget_take(n.budget, brick_bytes);
    n.runs = trip_budget_take(n.budget, run_bytes);
    n.runs_spare = trip_budget_take(n.budget, run_bytes);
    if (!n.bricks || !n.bricks_spare || !n.runs || !n.runs_spare) {
        release(&n);
        return trip_fail(
            TRIP_ERROR, "write", "",
            "no memory for the %zu bricks of a slab; raise --memory or use larger tiles", n.room);
    }
    if (s->brick_count > 0) {
        memcpy(n.bricks, s->bricks, s->brick_count * sizeof *n.bricks);
        memcpy(n.runs, s->runs, s->brick_count * s->sheets * sizeof *n.runs);
    }
    release(s);
    *s = n;
    return TRIP_OK;
}

/* Returns the tile's brick from an earlier sheet, or a new brick at the end. Returns NULL if memory
 * is exhausted. */
static trip_slab_brick *find(trip_slab *s, unsigned sheet, uint32_t tile_u, uint32_t tile_v)
{
    uint64_t tile = trip_morton(tile_u, tile_v);
    while (s->cursor < s->merged && s->bricks[s->cursor].tile < tile)
        s->cursor++;
    if (s->cursor < s->merged && s->bricks[s->cursor].tile == tile)
        return &s->bricks[s->cursor];
    if (s->brick_count == s->room && grow(s) < 0)
        return NULL;
    trip_slab_brick *b = &s->bricks[s->brick_count++];
    *b = (trip_slab_brick){ .tile = tile,
                            .brick = { .tile_u = tile_u,
                                       .tile_v = tile_v,
                                       .code_min = UINT16_MAX,
                                       .u_min = UINT8_MAX,
                                       .v_min = UINT8_MAX,
                                       .sheet_min = (uint8_t)sheet } };
    memset(s->runs + (size_t)(b - s->bricks) * s->sheets, 0, s->sheets * sizeof *s->runs);
    return b;
}

static void widen8(uint8_t *lo, uint8_t *hi, unsigned lo_new, unsigned hi_new)
{
    *lo = (uint8_t)(lo_new < *lo ? lo_new : *lo);
    *hi = (uint8_t)(hi_new > *hi ? hi_new : *hi);
}

static void widen(trip_file_brick *b, const uint32_t *voxels, uint32_t count)
{
    unsigned u_min = 255, u_max = 0, v_min = 255, v_max = 0;
    unsigned code_min = b->code_min, code_max = b->code_max;
    for (uint32_t i = 0; i < count; i++) {
        unsigned u = trip_voxel_u(voxels[i]), v = trip_voxel_v(voxels[i]);
        unsigned code = trip_voxel_code(voxels[i]);
        u_min = u < u_min ? u : u_min;
        u_max = u > u_max ? u : u_max;
        v_min = v < v_min ? v : v_min;
        v_max = v > v_max ? v : v_max;
        code_min = code < code_min ? code : code_min;
        code_max = code > code_max ? code : code_max;
    }
    widen8(&b->u_min, &b->u_max, u_min, u_max);
    widen8(&b->v_min, &b->v_max, v_min, v_max);
    b->code_min = (uint16_t)code_min;
    b->code_max = (uint16_t)code_max;
}

TRIP_ALSO_V3 const trip_file_brick *trip_slab_add(trip_slab *s, unsigned sheet, uint32_t tile_u,
                                                  uint32_t tile_v, const uint32_t *voxels,
                                                  const uint32_t *deviations, uint32_t count,
                                                  uint32_t words)
{
    trip_slab_brick *b = find(s, sheet, tile_u, tile_v);
    if (!b)
        return NULL;
    b->brick.records += count;
    b->brick.sheet_max = (uint8_t)sheet;
    s->runs[(size_t)(b - s->bricks) * s->sheets + sheet] =
        (trip_file_run){ (uint16_t)count, (uint16_t)words };
    widen(&b->brick, voxels, count);
    for (uint32_t i = 0; i < count && deviations; i++)
        if (deviations[i] > b->brick.deviation_max)
            b->brick.deviation_max = (uint8_t)deviations[i];
    return &b->brick;
}

static void move(trip_slab *s, size_t to, size_t from)
{
    s->bricks_spare[to] = s->bricks[from];
    memcpy(s->runs_spare + to * s->sheets, s->runs + from * s->sheets, s->sheets * sizeof *s->runs);
}

static void swap_spare(trip_slab *s)
{
    trip_slab_brick *bricks = s->bricks;
    trip_file_run *runs = s->runs;
    s->bricks = s->bricks_spare;
    s->runs = s->runs_spare;
    s->bricks_spare = bricks;
    s->runs_spare = runs;
}

/* Merges the new bricks of this sheet, which are in order, with the bricks of earlier sheets. */
void trip_slab_end_sheet(trip_slab *s)
{
    size_t old = 0, added = s->merged;
    if (added > 0 && added < s->brick_count) {
        for (size_t to = 0; to < s->brick_count; to++) {
            bool take_old = added == s->brick_count ||
                            (old < s->merged && s->bricks[old].tile < s->bricks[added].tile);
            move(s, to, take_old ? old++ : added++);
        }
        swap_spare(s);
    }
    s->merged = s->brick_count;
    s->cursor = 0;
}

void trip_slab_clear(trip_slab *s)
{
    s->brick_count = s->merged = s->cursor = 0;
}
