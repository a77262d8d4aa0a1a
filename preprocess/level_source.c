#include "level_source.h"

#include <assert.h>
#include <stdlib.h>

#include "format.h"
#include "report.h"

static const uint64_t TILE_MASK = (UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1;

typedef struct square_header {
    uint64_t key;
    uint32_t count, reserved;
} square_header;
static_assert(sizeof(square_header) == TRIP_LEVEL_SQUARE_BYTES, "what precedes voxels");

/* Every second bit of a Morton code, from bit 0. */
static int64_t even_bits(uint64_t m)
{
    int64_t n = 0;
    for (int bit = 0; bit < TRIP_TILE_MORTON_BITS / 2; bit++)
        n |= (int64_t)(m >> 2 * bit & 1) << bit;
    return n;
}

/* Places the square at hand, of a sheet and a Morton code, in one of the next level. */
static void place(trip_level_source *s, uint64_t sheet, uint64_t morton)
{
    unsigned up = s->edge_log2 + 1 - s->tile_log2;
    uint64_t within = morton & ((UINT64_C(1) << 2 * up) - 1);
    s->key = sheet >> 1 << TRIP_TILE_MORTON_BITS | morton >> 2 * up;
    s->u = even_bits(within) << s->tile_log2;
    s->v = even_bits(within >> 1) << s->tile_log2;
    s->has = true;
}

static int take_memory(trip_level_source *s)
{
    s->room = (size_t)1 << 2 * s->tile_log2;
    s->memory = trip_budget_take(s->budget, s->room * sizeof *s->memory);
    s->voxels = s->memory;
    if (s->memory)
        return 0;
    return trip_fail(TRIP_ERROR, "brick", "levels",
                     "need more memory: give more with --memory, or "
                     "leave them out with --levels 0");
}

int trip_level_source_list(trip_level_source *s, trip_writer *w, unsigned list, bool kept,
                           unsigned odd, unsigned tile_log2, unsigned edge_log2,
                           trip_budget *budget)
{
    *s = (trip_level_source){
        .budget = budget, .odd = odd, .kept = kept, .edge_log2 = edge_log2, .tile_log2 = tile_log2
    };
    int status = take_memory(s);
    if (status == 0)
        status = trip_list_cursor_open(&s->cursor, w, list, odd, budget);
    return status == 0 ? trip_level_source_next(s) : status;
}

int trip_level_source_file(trip_level_source *s, const trip_output *file, unsigned odd,
                           unsigned edge_log2, trip_budget *budget)
{
    *s = (trip_level_source){
        .budget = budget, .odd = odd, .file = file, .edge_log2 = edge_log2, .tile_log2 = edge_log2
    };
    int status = take_memory(s);
    return status == 0 ? trip_level_source_next(s) : status;
}

void trip_level_source_close(trip_level_source *s)
{
    trip_list_cursor_close(s->cursor);
    if (s->memory)
        trip_budget_release(s->budget, s->memory, s->room * sizeof *s->memory);
    *s = (trip_level_source){ 0 };
}

static void take_run(trip_level_source *s, const trip_list_run *run)
{
    for (uint32_t i = 0; i < run->count; i++) {
        const uint16_t code = (uint16_t)trip_voxel_code(run->voxels[i]);
        trip_coarse_voxel *to = &s->memory[i];
        *to = (trip_coarse_voxel){ .u = (uint8_t)trip_voxel_u(run->voxels[i]),
                                   .v = (uint8_t)trip_voxel_v(run->voxels[i]),
                                   .known = TRIP_COARSE_ALL,
                                   .value = code };
        if (!s->kept)
            continue;
        to->kept = to->cover[0] = to->cover[1] = to->cover[2] = TRIP_COARSE_ALL;
        to->mean = code;
        to->normal = run->normals ? run->normals[i] : 0;
    }
    s->count = run->count;
    place(s, run->sheet, trip_morton(run->tile_u, run->tile_v));
}

int trip_level_file_square(const trip_output *file, uint64_t at, unsigned edge_log2, uint64_t *key,
                           uint32_t *count)
{
    square_header h = { 0 };
    int status = trip_output_read(file, at, &h, sizeof h);
    *key = h.key;
    *count = h.count;
    if (status == 0 && h.count > UINT32_C(1) << 2 * edge_log2)
        status = trip_fail(TRIP_ERROR, "brick", file->path, "is not what was written");
    return status;
}

/* Over the sheets that are not wanted. */
static int next_of_file(trip_level_source *s)
{
    square_header h;
    while (s->at < s->file->bytes) {
        int status = trip_level_file_square(s->file, s->at, s->tile_log2, &h.key, &h.count);
        if (status < 0)
            return status;
        uint64_t sheet = h.key >> TRIP_TILE_MORTON_BITS, bytes = h.count * sizeof *s->memory;
        uint64_t first = s->at + sizeof h;
        s->at = first + bytes;
        if (sheet % 2 != s->odd)
            continue;
        place(s, sheet, h.key & TILE_MASK);
        s->count = h.count;
        return trip_output_read(s->file, first, s->memory, bytes);
    }
    return 0;
}

int trip_level_source_next(trip_level_source *s)
{
    trip_list_run run;
    s->has = false;
    if (s->file)
        return next_of_file(s);
    int status = trip_list_cursor_next(s->cursor, &run);
    if (status == 1)
        take_run(s, &run);
    return status < 0 ? status : 0;
}

int trip_level_file_append(trip_output *file, uint64_t key, const trip_coarse_voxel *voxels,
                           uint32_t count)
{
    const square_header h = { .key = key, .count = count };
    int status = trip_output_append(file, &h, sizeof h);
    return status == 0 ? trip_output_append(file, voxels, count * sizeof *voxels) : status;
}
