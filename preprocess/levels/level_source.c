#include "level_source.h"

#include <assert.h>

#include "format.h"
#include "report.h"

static const uint64_t TILE_MASK = (UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1;

typedef struct square_header {
    uint64_t key;
    uint32_t count, reserved;
} square_header;
static_assert(sizeof(square_header) == TRIP_LEVEL_SQUARE_BYTES, "header before the voxels");

/* Computes where the current square lies in the next level, from its sheet and Morton code. */
static void position(trip_level_source *s, uint64_t sheet, uint64_t morton)
{
    unsigned up = s->edge_log2 + 1 - s->tile_log2;
    uint64_t within = morton & ((UINT64_C(1) << 2 * up) - 1);
    s->key = sheet >> 1 << TRIP_TILE_MORTON_BITS | morton >> 2 * up;
    s->u = (int64_t)trip_morton_even(within) << s->tile_log2;
    s->v = (int64_t)trip_morton_even(within >> 1) << s->tile_log2;
    s->has = true;
}

int trip_level_source_list(trip_level_source *s, trip_writer *w, unsigned list, bool kept,
                           bool normals, unsigned odd, unsigned tile_log2, unsigned edge_log2,
                           trip_budget *budget)
{
    *s = (trip_level_source){
        .odd = odd, .kept = kept, .edge_log2 = edge_log2, .tile_log2 = tile_log2
    };
    int status = trip_list_cursor_open(&s->cursor, w, list, odd, normals, budget);
    return status == 0 ? trip_level_source_next(s) : status;
}

int trip_level_source_file(trip_level_source *s, const trip_output *file, bool means, unsigned odd,
                           unsigned edge_log2)
{
    *s = (trip_level_source){
        .odd = odd, .file = file, .means = means, .edge_log2 = edge_log2, .tile_log2 = edge_log2
    };
    return trip_level_source_next(s);
}

void trip_level_source_close(trip_level_source *s)
{
    trip_list_cursor_close(s->cursor);
    *s = (trip_level_source){ 0 };
}

int trip_level_file_square(const trip_output *file, uint64_t at, unsigned edge_log2, uint64_t *key,
                           uint32_t *count)
{
    square_header h = { 0 };
    int status = trip_output_read(file, at, &h, sizeof h);
    *key = h.key;
    *count = h.count;
    if (status == 0 && h.count > UINT32_C(1) << 2 * edge_log2)
        status = trip_fail(TRIP_ERROR, "brick", file->path, "differs from the data written");
    return status;
}

/* Advances to the next square of the file. Skips sheets of the other parity. */
static int next_of_file(trip_level_source *s)
{
    uint64_t key;
    while (s->next < s->file->bytes) {
        int status = trip_level_file_square(s->file, s->next, s->tile_log2, &key, &s->voxels.count);
        if (status < 0)
            return status;
        s->voxels.at = s->next + TRIP_LEVEL_SQUARE_BYTES;
        s->next = s->voxels.at + trip_level_voxels_bytes(s->voxels.count, s->means);
        if ((key >> TRIP_TILE_MORTON_BITS) % 2 == s->odd) {
            position(s, key >> TRIP_TILE_MORTON_BITS, key & TILE_MASK);
            return 0;
        }
    }
    return 0;
}

int trip_level_source_next(trip_level_source *s)
{
    s->has = false;
    if (s->file)
        return next_of_file(s);
    int status = trip_list_cursor_next(s->cursor, &s->run);
    if (status == 1)
        position(s, s->run.sheet, trip_morton(s->run.brick.tile_u, s->run.brick.tile_v));
    return status < 0 ? status : 0;
}

int trip_level_fail_memory(void)
{
    return trip_fail(TRIP_ERROR, "brick", "levels",
                     "need more memory; raise --memory, or skip them with --levels 0");
}

int trip_level_file_append(trip_output *file, uint64_t key, const trip_coarse_value *values,
                           const trip_coarse_mean *means, uint32_t count)
{
    const square_header h = { .key = key, .count = count };
    int status = trip_output_append(file, &h, sizeof h);
    if (status == 0)
        status = trip_output_append(file, values, count * sizeof *values);
    return status == 0 && means ? trip_output_append(file, means, count * sizeof *means) : status;
}
