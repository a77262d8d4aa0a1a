#include "splat_box.h"

#include <string.h>

#include "clones.h"
#include "format.h"
#include "report.h"

int64_t trip_splat_box_edge(const trip_piece_format *f)
{
    return f->tile_log2 > 6 ? (int64_t)1 << f->tile_log2 : 64;
}

void trip_splat_box_tables_fill(trip_splat_box_tables *t, const trip_piece_format *f)
{
    t->edge = trip_splat_box_edge(f);
    t->words = (unsigned)(t->edge * t->edge / 64);
    for (unsigned x = 0; x < TRIP_TILE_MAX_EDGE; x++)
        t->even_bits[x] = (uint16_t)trip_morton(x, 0);
    for (unsigned v = 0; v < (unsigned)t->edge; v++)
        for (unsigned u = 0; u < (unsigned)t->edge; u++) {
            t->u_of[trip_morton(u, v)] = (uint16_t)u;
            t->v_of[trip_morton(u, v)] = (uint16_t)v;
        }
}

void trip_splat_box_begin(trip_splat_box *c, const int64_t lo[3], const int64_t size[3])
{
    const size_t words = c->tables->words;
    for (int a = 0; a < 3; a++) {
        c->size[a] = size[a];
        c->origin[a] = a == 2 ? lo[a] : lo[a] & ~(c->tables->edge - 1);
        c->first[a] = lo[a] - c->origin[a];
        memset(c->bits[a] + (size_t)c->first[a] * words, 0,
               (size_t)size[a] * words * sizeof(uint64_t));
    }
}

/* In the sheets along X and Y, the coordinate from z counts from a multiple of the edge, as tiles
 * do. */
void trip_splat_box_mark(trip_splat_box *c, int64_t y, int64_t z, const uint8_t *x, unsigned count)
{
    const uint16_t *even = c->tables->even_bits;
    const size_t words = c->tables->words;
    const unsigned y_bits = even[y], z_bits = even[(c->origin[2] + z) & (c->tables->edge - 1)];
    const unsigned in_x = y_bits | z_bits << 1; /* in all sheets along X */
    uint64_t *x_words = c->bits[0] + in_x / 64;
    uint64_t *y_sheet = c->bits[1] + (size_t)y * words;
    uint64_t *z_sheet = c->bits[2] + (size_t)z * words;
    const uint64_t x_bit = UINT64_C(1) << (in_x % 64);
    for (unsigned i = 0; i < count; i++) {
        unsigned bits = even[x[i]], in_y = z_bits | bits << 1, in_z = bits | y_bits << 1;
        x_words[x[i] * words] |= x_bit;
        y_sheet[in_y / 64] |= UINT64_C(1) << (in_y % 64);
        z_sheet[in_z / 64] |= UINT64_C(1) << (in_z % 64);
    }
}

/* The splats of one tile of one sheet, which become a piece. */
typedef struct tile_splats {
    int axis;
    int64_t sheet;           /* local */
    unsigned first_position; /* Morton code of the tile's first voxel, relative to a multiple of the
                                edge */
    const uint64_t *bitmap;  /* of the tile */
} tile_splats;

static uint64_t key_of(const trip_splat_box *c, unsigned tile_log2, const tile_splats *t)
{
    const int u = (t->axis + 1) % 3, v = (t->axis + 2) % 3;
    const int64_t edge = c->tables->edge;
    const int64_t corner[3] = { c->origin[0], c->origin[1], c->origin[2] & ~(edge - 1) };
    uint32_t tile_u = (uint32_t)((corner[u] + c->tables->u_of[t->first_position]) >> tile_log2);
    uint32_t tile_v = (uint32_t)((corner[v] + c->tables->v_of[t->first_position]) >> tile_log2);
    return (uint64_t)(c->origin[t->axis] + t->sheet) << TRIP_TILE_MORTON_BITS |
           trip_morton(tile_u, tile_v);
}

/* Writes the array indices of the splats in list order and returns their number. */
static uint32_t gather_indices(const trip_splat_box *c, unsigned words, const tile_splats *t,
                               uint32_t *indices)
{
    const int64_t edge = c->tables->edge, stride[3] = { 1, edge, edge * edge };
    const int64_t su = stride[(t->axis + 1) % 3], sv = stride[(t->axis + 2) % 3];
    /* z counts from a multiple of the edge in bitmaps, and from the box's start in arrays. */
    int64_t base = t->sheet * stride[t->axis];
    if (t->axis != 2)
        base -= (c->origin[2] & (edge - 1)) * stride[2];
    uint32_t n = 0;
    for (unsigned w = 0; w < words; w++)
        for (uint64_t bits = t->bitmap[w]; bits; bits &= bits - 1) {
            unsigned position = t->first_position + w * 64 + (unsigned)__builtin_ctzll(bits);
            indices[n++] =
                (uint32_t)(base + c->tables->u_of[position] * su + c->tables->v_of[position] * sv);
        }
    return n;
}

static void fill_piece(const trip_splat_box *c, const trip_piece_format *f, trip_piece *piece,
                       const uint32_t *indices, uint32_t splats)
{
    unsigned char *base = (unsigned char *)piece;
    trip_piece_parts parts = trip_piece_get_parts(f, piece);
    uint16_t *codes = (void *)(base + parts.values);
    uint32_t *floats = (void *)(base + parts.values), *normals = (void *)(base + parts.normals);
    float *magnitudes = (void *)(base + parts.magnitudes);
    if (f->quantised)
        for (uint32_t i = 0; i < splats; i++)
            codes[i] = (uint16_t)c->values[indices[i]];
    else
        for (uint32_t i = 0; i < splats; i++)
            floats[i] = c->values[indices[i]];
    for (uint32_t i = 0; i < splats && parts.deviations; i++)
        base[parts.deviations + i] = (uint8_t)(c->values[indices[i]] >> 16);
    if (parts.normals)
        for (uint32_t i = 0; i < splats; i++)
            normals[i] = c->normals[indices[i]];
    if (parts.magnitudes)
        for (uint32_t i = 0; i < splats; i++)
            magnitudes[i] = c->magnitudes[indices[i]];
}

static int emit_piece(const trip_splat_box *c, const trip_piece_format *f, unsigned list,
                      const tile_splats *t, const trip_piece_sink *sink)
{
    uint32_t indices[TRIP_TILE_MAX_SPLATS];
    unsigned used = 0;
    for (unsigned w = 0; w < trip_tile_words(f); w++)
        used += t->bitmap[w] != 0;
    if (used == 0)
        return 0;
    uint32_t splats = gather_indices(c, trip_tile_words(f), t, indices);
    unsigned words = trip_piece_choose_words(f, splats, used);
    size_t bytes = trip_piece_layout(f, splats, words).bytes;
    void *piece;
    int status = sink->reserve(sink->user, sink->thread, list, bytes, &piece);
    if (status < 0)
        return status;
    trip_piece_begin(piece, f, key_of(c, f->tile_log2, t), splats, words, t->bitmap);
    fill_piece(c, f, piece, indices, splats);
    return 0;
}

TRIP_ALSO_V3 int trip_splat_box_emit(const trip_splat_box *c, const trip_piece_format *f,
                                     unsigned list, const trip_piece_sink *sink)
{
    const unsigned words = c->tables->words;
    const int axis = trip_list_axis(list);
    int status = 0;
    for (int64_t i = 0; i < c->size[axis] && status == 0; i++) {
        const int64_t sheet = c->first[axis] + i;
        const uint64_t *bits = c->bits[axis] + (size_t)sheet * words;
        for (unsigned w = 0; w < words && status == 0; w += trip_tile_words(f))
            status = emit_piece(c, f, list, &(tile_splats){ axis, sheet, w * 64, bits + w }, sink);
    }
    return status;
}
