#include "level_lane.h"

#include <string.h>

#include "clones.h"
#include "deviation.h"
#include "format.h"

size_t trip_level_lane_make(trip_level_lane *l, const trip_level_work *w, unsigned producer,
                            unsigned char *memory)
{
    const size_t edge = (size_t)1 << w->edge_log2, plane = edge * edge;
    const unsigned below_log2 = w->lists ? w->format.tile_log2 : w->edge_log2;
    const size_t squares = (size_t)TRIP_LEVEL_SOURCES << 2 * (w->edge_log2 + 1 - below_log2);
    size_t used = 0;
    *l = (trip_level_lane){ .producer = producer, .box.tables = &w->tables };
    l->squares = trip_level_carve(memory, &used, squares * sizeof *l->squares);
    l->value_sums = trip_level_carve(memory, &used, plane * sizeof *l->value_sums);
    l->values = trip_level_carve(memory, &used, plane * sizeof *l->values);
    l->touched = trip_level_carve(memory, &used, plane / 8);
    if (w->labels)
        l->value_votes = trip_level_carve(memory, &used, plane * sizeof *l->value_votes);
    if (w->labels && w->means)
        l->mean_votes = trip_level_carve(memory, &used, plane * sizeof *l->mean_votes);
    if (w->means) {
        l->mean_sums = trip_level_carve(memory, &used, plane * sizeof *l->mean_sums);
        l->means = trip_level_carve(memory, &used, plane * sizeof *l->means);
        l->box.normals = trip_level_carve(memory, &used, plane * sizeof(uint32_t));
    }
    const size_t sheets = w->values ? TRIP_SHARPEN_SHEETS : 1;
    l->box.values = trip_level_carve(memory, &used, sheets * plane * sizeof(uint32_t));
    for (int axis = 0; axis < 3; axis++)
        l->box.bits[axis] =
            trip_level_carve(memory, &used, (axis == 2 ? sheets : edge) * plane / 8);
    if (w->lists)
        l->run = trip_level_carve(memory, &used, trip_list_buffer_bytes());
    else
        l->values_below = trip_level_carve(memory, &used, plane * sizeof *l->values_below);
    if (!w->lists && w->means)
        l->means_below = trip_level_carve(memory, &used, plane * sizeof *l->means_below);
    if (w->format.halo)
        used += trip_sharpen_lane_make(&l->sharpen, w->edge_log2, memory ? memory + used : NULL);
    return used;
}

/* ---- sums ---- */

static void gradient_of(const trip_level_work *w, uint32_t normal, double gradient[3])
{
    if (w->compact)
        trip_compact_normal_unpack(w->compact, normal, gradient);
    else
        trip_normal_unpack(normal, w->quantiser.gradient_full, gradient);
}

/* Packs the normal of a gradient in world space. */
static uint32_t normal_of(const trip_level_work *w, const double gradient[3])
{
    const double(*j)[4] = w->index_to_world.m;
    double index[3];
    if (!w->compact)
        return trip_normal_pack(gradient, w->quantiser.gradient_full);
    for (int a = 0; a < 3; a++)
        index[a] = j[0][a] * gradient[0] + j[1][a] * gradient[1] + j[2][a] * gradient[2];
    return trip_compact_normal_pack(w->compact, index);
}

static bool has_table(const trip_level_work *w)
{
    return w->value_of || w->quantiser.ids;
}

/* Adds a share of a code that has a place in a table. */
static void add_uneven(const trip_level_work *w, trip_coarse_uneven *to, uint32_t share,
                       uint16_t code)
{
    if (w->quantiser.ids)
        trip_coarse_vote(to, share, code);
    else
        to->values += (double)share * w->value_of[code];
}

/* Returns the code of a sum of shares. */
static uint16_t code_of_sum(const trip_level_work *w, const trip_coarse_uneven *sum, double shares)
{
    return w->quantiser.ids ? (uint16_t)sum->id
                            : (uint16_t)trip_knots_code(w->quantiser.knots, sum->values / shares);
}

/* Clears the sums of a voxel before its first contribution. */
static void touch(trip_level_lane *l, size_t at)
{
    const uint64_t bit = UINT64_C(1) << at % 64;
    if (l->touched[at / 64] & bit)
        return;
    l->touched[at / 64] |= bit;
    l->value_sums[at] = (trip_coarse_value_sum){ 0 };
    if (l->mean_sums)
        trip_coarse_mean_clear(&l->mean_sums[at]);
    if (l->value_votes)
        l->value_votes[at] = (trip_coarse_votes){ .used = 0 };
    if (l->mean_votes)
        l->mean_votes[at] = (trip_coarse_votes){ .used = 0 };
}

/* Maps a voxel of the level below: index of its coarse voxel in the sums, and parity of its
 * coordinates. */
typedef struct position {
    size_t at;
    unsigned odd;
} position;

static position position_of(const trip_level_work *w, const trip_level_source *square, unsigned u,
                            unsigned v)
{
    const size_t x = (size_t)square->u + u, y = (size_t)square->v + v;
    return (position){ (y >> 1 << w->edge_log2) + (x >> 1),
                       (unsigned)((x & 1) | (y & 1) << 1) | square->odd << 2 };
}

/* Offset (u, v) of the coarse voxel for each four consecutive voxels of a square. All four belong
 * to the same coarse voxel. */
#define CELL(n)                                                                                    \
    {                                                                                              \
        ((n)&1) | ((n) >> 1 & 2), ((n) >> 1 & 1) | ((n) >> 2 & 2)                                  \
    }
#define CELLS4(n) CELL(n), CELL((n) + 1), CELL((n) + 2), CELL((n) + 3)
static const uint8_t cells[16][2] = { CELLS4(0), CELLS4(4), CELLS4(8), CELLS4(12) };

/* Returns the number of set bits of each group of four bits, in the same four bits. */
static uint64_t counts_of(uint64_t mask)
{
    const uint64_t twos = mask - (mask >> 1 & UINT64_C(0x5555555555555555));
    return (twos & UINT64_C(0x3333333333333333)) + (twos >> 2 & UINT64_C(0x3333333333333333));
}

/* Computes the minimum turned code of each group of four voxels. */
static void find_around(const trip_square *of, const uint16_t *codes, bool round,
                        uint16_t around[16])
{
    memset(around, 255, 16 * sizeof *around);
    for (uint64_t rest = of->mask; rest; rest &= rest - 1, codes++) {
        const int n = __builtin_ctzll(rest) / 4;
        const uint16_t turned = trip_coarse_turned(*codes, round);
        around[n] = turned < around[n] ? turned : around[n];
    }
}

static void add_values(trip_level_lane *l, const trip_level_work *w,
                       const trip_level_source *square, const trip_square *of)
{
    const uint32_t corner = trip_square_corner(of);
    const size_t first = position_of(w, square, trip_voxel_u(corner), trip_voxel_v(corner)).at;
    uint32_t sums[65]; /* sums[i] adds up the first i codes, squares[i] their squares */
    uint64_t squares[65];
    uint16_t codes[64], around[16];
    trip_square_codes(of, codes);
    sums[0] = 0;
    squares[0] = 0;
    for (uint32_t i = 0; i < of->count; i++) {
        sums[i + 1] = sums[i] + codes[i];
        squares[i + 1] = squares[i] + (uint32_t)codes[i] * codes[i];
    }
    if (!square->kept)
        find_around(of, codes, w->hidden_above, around);
    const uint64_t counts = counts_of(of->mask);
    uint64_t some = (counts | counts >> 1 | counts >> 2) & UINT64_C(0x1111111111111111);
    for (uint32_t before = 0; some; some &= some - 1) {
        const int bit = __builtin_ctzll(some), n = bit / 4;
        const uint32_t count = counts >> bit & 15;
        const size_t at = first + ((size_t)cells[n][1] << w->edge_log2) + cells[n][0];
        touch(l, at);
        trip_coarse_value_add_whole(&l->value_sums[at], count, sums[before + count] - sums[before],
                                    squares[before + count] - squares[before], square->kept);
        for (uint32_t i = before; i < before + count && has_table(w); i++)
            add_uneven(w, &l->value_sums[at].uneven, TRIP_COARSE_ALL, codes[i]);
        if (!square->kept)
            trip_coarse_value_add_around(&l->value_sums[at], around[n]);
        for (uint32_t i = before; i < before + count && l->value_votes; i++)
            trip_coarse_votes_add(&l->value_votes[at], codes[i], TRIP_COARSE_ALL);
        before += count;
    }
}

static void add_means(trip_level_lane *l, const trip_level_work *w, const trip_level_source *square,
                      const trip_block *run, const trip_square *of)
{
    uint32_t voxels[64], normals[64];
    double gradient[3];
    trip_square_voxels(of, voxels);
    if (run->normals)
        trip_block_normals(run, of->first, of->count, normals);
    for (uint32_t i = 0; i < of->count; i++) {
        const position p = position_of(w, square, trip_voxel_u(voxels[i]), trip_voxel_v(voxels[i]));
        if (run->normals)
            gradient_of(w, normals[i], gradient);
        trip_coarse_mean_add_whole(&l->mean_sums[p.at], (uint16_t)trip_voxel_code(voxels[i]), p.odd,
                                   run->normals ? gradient : NULL);
        if (has_table(w))
            add_uneven(w, &l->mean_sums[p.at].uneven, TRIP_COARSE_ALL,
                       (uint16_t)trip_voxel_code(voxels[i]));
        if (l->mean_votes)
            trip_coarse_votes_add(&l->mean_votes[p.at], (uint16_t)trip_voxel_code(voxels[i]),
                                  TRIP_COARSE_ALL);
    }
}

/* Returns the number of words of the first run and of the runs directly behind it in its list. */
static uint64_t words_together(const trip_level_source *squares, unsigned count)
{
    const uint64_t first = squares->run.at[TRIP_PLANE_VOXELS];
    uint64_t words = 0;
    for (unsigned i = 0; i < count && squares[i].cursor == squares->cursor &&
                         squares[i].run.at[TRIP_PLANE_VOXELS] == first + 8 * words;
         i++)
        words += squares[i].run.run.words;
    return words;
}

static int add_run(trip_level_lane *l, const trip_level_work *w, const trip_level_source *of,
                   unsigned count)
{
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    trip_block run;
    int status =
        trip_list_cursor_read(of->cursor, &of->run, words_together(of, count), l->run, &run);
    const uint32_t n = status == 0 ? trip_block_squares(&run, squares) : 0;
    for (uint32_t i = 0; i < n; i++) {
        add_values(l, w, of, &squares[i]);
        if (l->mean_sums && of->kept)
            add_means(l, w, of, &run, &squares[i]);
    }
    return status;
}

static int read_square(trip_level_lane *l, const trip_level_source *square)
{
    const uint32_t count = square->voxels.count;
    const uint64_t at = square->voxels.at, values = count * sizeof *l->values_below;
    int status = trip_output_read(square->file, at, l->values_below, values);
    if (status == 0 && l->means_below)
        status = trip_output_read(square->file, at + values, l->means_below,
                                  count * sizeof *l->means_below);
    return status;
}

static int add_voxels(trip_level_lane *l, const trip_level_work *w, const trip_level_source *square)
{
    double gradient[3];
    int status = read_square(l, square);
    for (uint32_t i = 0; i < square->voxels.count && status == 0; i++) {
        const trip_coarse_value *value = &l->values_below[i];
        const position p = position_of(w, square, value->u, value->v);
        touch(l, p.at);
        trip_coarse_value_add(&l->value_sums[p.at], value, w->hidden_above);
        if (has_table(w))
            add_uneven(w, &l->value_sums[p.at].uneven, value->known, value->value);
        if (l->value_votes)
            trip_coarse_votes_add(&l->value_votes[p.at], value->value, value->known);
        if (!l->means_below || !l->means_below[i].kept)
            continue;
        if (w->format.normals)
            gradient_of(w, l->means_below[i].normal, gradient);
        trip_coarse_mean_add(&l->mean_sums[p.at], &l->means_below[i], p.odd,
                             w->format.normals ? gradient : NULL);
        if (has_table(w))
            add_uneven(w, &l->mean_sums[p.at].uneven, l->means_below[i].kept,
                       l->means_below[i].mean);
        if (l->mean_votes)
            trip_coarse_votes_add(&l->mean_votes[p.at], l->means_below[i].mean,
                                  l->means_below[i].kept);
    }
    return status;
}

TRIP_ALSO_V3 int trip_level_lane_add(trip_level_lane *l, const trip_level_work *w,
                                     const trip_level_source *squares, unsigned count)
{
    return w->lists ? add_run(l, w, squares, count) : add_voxels(l, w, squares);
}

static void take_mean(const trip_level_lane *l, const trip_level_work *w, size_t at,
                      trip_coarse_mean *mean)
{
    double gradient[3];
    const trip_coarse_mean_sum *sum = &l->mean_sums[at];
    trip_coarse_mean_get(sum, mean);
    if (has_table(w) && mean->kept)
        mean->mean = code_of_sum(w, &sum->uneven, (double)sum->kept);
    if (l->mean_votes && mean->kept)
        mean->mean = trip_coarse_votes_get(&l->mean_votes[at]);
    trip_coarse_mean_gradient(&l->mean_sums[at], gradient);
    if (mean->kept && w->format.normals)
        mean->normal = normal_of(w, gradient);
}

TRIP_ALSO_V3 uint32_t trip_level_lane_take(trip_level_lane *l, const trip_level_work *w)
{
    const size_t words = (size_t)1 << (2 * w->edge_log2 - 6), edge = (size_t)1 << w->edge_log2;
    uint32_t n = 0;
    for (size_t word = 0; word < words; word++) {
        for (uint64_t bits = l->touched[word]; bits; bits &= bits - 1) {
            const size_t at = word * 64 + (size_t)__builtin_ctzll(bits);
            l->values[n].u = (uint8_t)(at & (edge - 1));
            l->values[n].v = (uint8_t)(at >> w->edge_log2);
            trip_coarse_value_get(&l->value_sums[at], &l->values[n]);
            if (has_table(w))
                l->values[n].value =
                    code_of_sum(w, &l->value_sums[at].uneven, l->value_sums[at].known);
            if (l->value_votes)
                l->values[n].value = trip_coarse_votes_get(&l->value_votes[at]);
            if (l->means)
                take_mean(l, w, at, &l->means[n]);
            n++;
        }
        l->touched[word] = 0;
    }
    return n;
}

/* ---- pieces ---- */

static int reserve(void *user, unsigned thread, unsigned list, size_t bytes, void **memory)
{
    return trip_list_builder_reserve(user, thread, list, bytes, memory);
}

/* Begins a box of voxels for one square or several consecutive ones, with none marked yet. */
static void begin_squares(trip_level_lane *l, const trip_level_work *w, uint64_t sheet,
                          uint64_t morton, int64_t sheets)
{
    const int64_t edge = (int64_t)1 << w->edge_log2;
    const int64_t size[3] = { edge, edge, sheets };
    const int64_t lo[3] = { (int64_t)trip_morton_even(morton) << w->edge_log2,
                            (int64_t)trip_morton_even(morton >> 1) << w->edge_log2,
                            (int64_t)sheet };
    trip_splat_box_begin(&l->box, lo, size);
}

/* Marks a voxel. Returns its index in the box. */
static size_t mark(trip_level_lane *l, const trip_coarse_value *voxel, int64_t sheet)
{
    trip_splat_box_mark(&l->box, voxel->v, sheet, &voxel->u, 1);
    return trip_splat_box_row(&l->box, voxel->v, sheet) + voxel->u;
}

static int emit(trip_level_lane *l, const trip_level_work *w, unsigned list)
{
    const trip_piece_format f = trip_piece_format_of(&w->format, list);
    const trip_piece_sink sink = { reserve, w->builder, l->producer };
    return trip_splat_box_emit(&l->box, &f, list, &sink);
}

static uint32_t shares_of(const trip_coarse_mean *mean, int axis)
{
    if (mean->kept == TRIP_COARSE_ALL)
        return TRIP_MEAN_SHARES - 1;
    return trip_mean_pack_shares(mean->cover[axis] / (double)TRIP_COARSE_ALL,
                                 mean->kept / (double)mean->cover[axis]);
}

/* Writes the members that differ between the lists of means. */
static void put_shares(trip_level_lane *l, uint32_t count, int axis)
{
    for (uint32_t i = 0; i < count; i++) {
        const trip_coarse_value *voxel = &l->values[i];
        const size_t at = trip_splat_box_row(&l->box, voxel->v, 0) + voxel->u;
        if (l->means[i].kept)
            l->box.values[at] = (l->box.values[at] & ~(uint32_t)(TRIP_MEAN_SHARES - 1)) |
                                shares_of(&l->means[i], axis);
    }
}

int trip_level_lane_emit_means(trip_level_lane *l, const trip_level_work *w, uint64_t key,
                               uint32_t count)
{
    bool some = false;
    int status = 0;
    begin_squares(l, w, key >> TRIP_TILE_MORTON_BITS,
                  key & ((UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1), 1);
    for (uint32_t i = 0; i < count; i++) {
        if (!l->means[i].kept)
            continue;
        const size_t at = mark(l, &l->values[i], 0);
        l->box.normals[at] = l->means[i].normal;
        l->box.values[at] = trip_mean_pack_value(&w->scale, l->means[i].mean);
        some = true;
    }
    for (unsigned list = 0; list < TRIP_HALO_LISTS && some && status == 0; list++) {
        put_shares(l, count, trip_list_axis(list));
        status = emit(l, w, list);
    }
    return status;
}

static uint32_t value_code(const trip_level_work *w, const trip_coarse_value *voxel)
{
    const unsigned step = w->quantiser.bytes ? TRIP_CODE_STEP : 1;
    return (voxel->value + step / 2) / step * step;
}

/* Returns the code of a sharpened voxel's deviation. */
static uint32_t deviation(const trip_level_work *w, const trip_coarse_value *voxel)
{
    return w->format.deviations ? trip_deviation_pack((double)voxel->variance) : 0;
}

/* Puts the sharpened voxels of a square into the box. */
static void put_values(trip_level_lane *l, const trip_level_work *w, uint32_t count, int sheet)
{
    const trip_coarse_value *voxels = l->sharpen.values;
    uint8_t x[TRIP_TILE_MAX_EDGE];
    for (uint32_t i = 0; i < count;) {
        const uint8_t y = voxels[i].v;
        uint32_t *row = l->box.values + trip_splat_box_row(&l->box, y, sheet);
        unsigned n = 0;
        for (; i < count && voxels[i].v == y && n < TRIP_TILE_MAX_EDGE; i++) {
            row[voxels[i].u] = value_code(w, &voxels[i]) | deviation(w, &voxels[i]) << 16;
            x[n++] = voxels[i].u;
        }
        trip_splat_box_mark(&l->box, y, sheet, x, n);
    }
}

TRIP_ALSO_V3 int trip_level_lane_emit_values(trip_level_lane *l, const trip_level_work *w,
                                             const trip_sharpen *sharpen,
                                             const trip_sharpen_column *column)
{
    int status = 0;
    begin_squares(l, w, column->sheet, column->morton, TRIP_SHARPEN_SHEETS);
    for (int sheet = 0; sheet < TRIP_SHARPEN_SHEETS && status == 0; sheet++) {
        const trip_sharpen_neighbourhood *of = &column->squares[sheet];
        if (of->square.count > 0)
            status = trip_sharpen_do(sharpen, &l->sharpen, of);
        if (status == 0)
            put_values(l, w, of->square.count, sheet);
    }
    for (unsigned list = TRIP_HALO_LISTS; list < TRIP_MAX_LISTS && status == 0; list++)
        status = emit(l, w, list);
    return status;
}
