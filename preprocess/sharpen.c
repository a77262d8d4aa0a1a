#include "sharpen.h"

#include <string.h>

#include "clones.h"
#include "format.h"
#include "report.h"

/* Squares held besides the one at hand. */
enum { HELD = 32 };

static const uint64_t TILE_MASK = (UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1;

/* By row. */
struct trip_sharpen_square {
    uint64_t key;
    bool held;
    uint16_t *known; /* all bits, or none where there is no voxel */
    uint16_t *values;
};

size_t trip_sharpen_lane_make(trip_sharpen_lane *l, unsigned edge_log2, unsigned char *memory)
{
    const size_t plane = (size_t)1 << 2 * edge_log2;
    size_t at = 0;
    l->values = trip_level_carve(memory, &at, plane * sizeof *l->values);
    l->beside = trip_level_carve(memory, &at, plane * sizeof *l->beside);
    l->sums = trip_level_carve(memory, &at, plane * sizeof *l->sums);
    l->squares = trip_level_carve(memory, &at, (1 + HELD) * sizeof *l->squares);
    for (int i = 0; i < 1 + HELD; i++) {
        uint16_t *known = trip_level_carve(memory, &at, plane * sizeof *known);
        uint16_t *values = trip_level_carve(memory, &at, plane * sizeof *values);
        if (memory)
            l->squares[i] = (trip_sharpen_square){ .known = known, .values = values };
    }
    return at;
}

void trip_sharpen_open(trip_sharpen *s, const trip_output *file, bool means, bool round,
                       unsigned edge_log2, trip_budget *budget)
{
    *s =
        (trip_sharpen){ .file = file, .edge_log2 = edge_log2, .round = round, .sheet = UINT64_MAX };
    trip_level_positions_open(&s->positions, file, means, edge_log2, budget);
}

void trip_sharpen_close(trip_sharpen *s)
{
    trip_level_positions_close(&s->positions);
    *s = (trip_sharpen){ 0 };
}

/* ---- squares ---- */

/* `values`: of the lane, for what is read. */
static int read_square(const trip_sharpen *s, const trip_level_position *position,
                       trip_coarse_value *values, trip_sharpen_square *to)
{
    int status = trip_output_read(s->file, position->at, values, position->count * sizeof *values);
    to->key = position->key;
    to->held = status == 0;
    memset(to->known, 0, sizeof *to->known << 2 * s->edge_log2);
    for (uint32_t i = 0; i < position->count && status == 0; i++) {
        const size_t at = ((size_t)values[i].v << s->edge_log2) + values[i].u;
        to->known[at] = UINT16_MAX;
        to->values[at] = values[i].value;
    }
    return status;
}

static int hold_square(const trip_sharpen *s, trip_sharpen_lane *l,
                       const trip_level_position *position, const trip_sharpen_square **out)
{
    trip_sharpen_square *square =
        &l->squares[1 + (position->key * UINT64_C(0x9e3779b97f4a7c15) >> 32) % HELD];
    *out = square;
    return square->held && square->key == position->key
               ? 0
               : read_square(s, position, l->beside, square);
}

/* Where the others are there. */
static void add_differences(int32_t *restrict sums, const uint16_t *here, const uint16_t *others,
                            const uint16_t *known, size_t count)
{
    for (size_t i = 0; i < count; i++)
        sums[i] += (here[i] & known[i]) - (others[i] & known[i]);
}

/* Of the square at hand the voxels of `count` rows from `row` on and of `width` columns from
 * `column` on, with those of another that are `shift` further. */
static void add_beside(const trip_sharpen *s, trip_sharpen_lane *l,
                       const trip_sharpen_square *other, size_t row, size_t count, size_t column,
                       size_t width, ptrdiff_t shift)
{
    const trip_sharpen_square *here = &l->squares[0];
    for (size_t v = row; v < row + count; v++) {
        const size_t at = (v << s->edge_log2) + column;
        add_differences(l->sums + at, here->values + at, other->values + at + shift,
                        other->known + at + shift, width);
    }
}

static int add_square(const trip_sharpen *s, trip_sharpen_lane *l,
                      const trip_level_position *position, size_t row, size_t count, size_t column,
                      size_t width, ptrdiff_t shift)
{
    const trip_sharpen_square *other = NULL;
    int status = position->count > 0 ? hold_square(s, l, position, &other) : 0;
    if (status == 0 && position->count > 0)
        add_beside(s, l, other, row, count, column, width, shift);
    return status;
}

/* Along u and v, within the square at hand and from those around it; and from the sheets before and
 * behind. */
static int add_around(const trip_sharpen *s, trip_sharpen_lane *l,
                      const trip_level_position beside[6])
{
    const size_t edge = (size_t)1 << s->edge_log2, last = edge - 1;
    const ptrdiff_t down = (ptrdiff_t)edge, across = (ptrdiff_t)last;
    const trip_sharpen_square *here = &l->squares[0];
    add_beside(s, l, here, 0, edge, 1, last, -1);
    add_beside(s, l, here, 0, edge, 0, last, 1);
    add_beside(s, l, here, 1, last, 0, edge, -down);
    add_beside(s, l, here, 0, last, 0, edge, down);
    int status = add_square(s, l, &beside[0], 0, edge, 0, 1, across);
    if (status == 0)
        status = add_square(s, l, &beside[1], 0, edge, last, 1, -across);
    if (status == 0)
        status = add_square(s, l, &beside[2], 0, 1, 0, edge, across * down);
    if (status == 0)
        status = add_square(s, l, &beside[3], last, 1, 0, edge, -across * down);
    for (int i = 4; i < 6 && status == 0; i++)
        status = add_square(s, l, &beside[i], 0, edge, 0, edge, 0);
    return status;
}

/* value + sum / TRIP_SHARPEN_PART, the nearest. */
static uint16_t sharpened(uint16_t value, int32_t sum)
{
    const int32_t half = sum < 0 ? -TRIP_SHARPEN_PART / 2 : TRIP_SHARPEN_PART / 2;
    const int32_t to = value + (sum + half) / TRIP_SHARPEN_PART;
    return (uint16_t)(to < 0 ? 0 : to > UINT16_MAX ? UINT16_MAX : to);
}

/* What covers nothing known has a value that does not show, and is moved away from what does alone.
 */
static uint16_t sharpened_value(const trip_sharpen *s, const trip_coarse_value *voxel, int32_t sum)
{
    const bool towards = s->round ? sum < 0 : sum > 0;
    return voxel->known == 0 && towards ? voxel->value : sharpened(voxel->value, sum);
}

TRIP_ALSO_V3 int trip_sharpen_do(const trip_sharpen *s, trip_sharpen_lane *l,
                                 const trip_sharpen_neighbourhood *of)
{
    const trip_level_position *position = &of->square;
    int status = read_square(s, position, l->values, &l->squares[0]);
    memset(l->sums, 0, sizeof *l->sums << 2 * s->edge_log2);
    if (status == 0)
        status = add_around(s, l, of->beside);
    for (uint32_t i = 0; i < position->count && status == 0; i++) {
        trip_coarse_value *voxel = &l->values[i];
        const int32_t sum = l->sums[((size_t)voxel->v << s->edge_log2) + voxel->u];
        voxel->value = sharpened_value(s, voxel, sum);
    }
    return status;
}

/* ---- one after the other ---- */

/* The first sheet of the next columns, UINT64_MAX when there are none. */
static int next_sheet(trip_sharpen *s, uint64_t *first)
{
    const uint64_t behind = s->sheet + TRIP_SHARPEN_SHEETS;
    if (s->sheet != UINT64_MAX && trip_level_positions_sheet(&s->positions, behind)) {
        *first = behind;
        return 0;
    }
    int status = trip_level_positions_next(&s->positions, first);
    if (*first != UINT64_MAX)
        *first = *first / TRIP_SHARPEN_SHEETS * TRIP_SHARPEN_SHEETS;
    return status;
}

static void find_beside(const trip_sharpen *s, trip_sharpen_neighbourhood *of)
{
    const uint64_t key = of->square.key;
    for (int i = 0; i < 6; i++) {
        const int step = i % 2 ? 1 : -1;
        of->beside[i] = trip_level_position_beside(&s->positions, key, i / 2 == 0 ? step : 0,
                                                   i / 2 == 1 ? step : 0, i / 2 == 2 ? step : 0);
    }
}

/* Of a sheet of the columns at hand the square that is next; NULL: there is none. */
static const trip_level_position *next_position(const trip_sharpen *s, unsigned i)
{
    const trip_level_sheet *sheet = trip_level_positions_sheet(&s->positions, s->sheet + i);
    return sheet && s->next[i] < sheet->count ? &sheet->positions[s->next[i]] : NULL;
}

/* Where the next column lies in its sheets; UINT64_MAX: there is none in those at hand. */
static uint64_t next_morton(const trip_sharpen *s)
{
    uint64_t min = UINT64_MAX;
    for (unsigned i = 0; i < TRIP_SHARPEN_SHEETS && s->sheet != UINT64_MAX; i++) {
        const trip_level_position *position = next_position(s, i);
        if (position && (position->key & TILE_MASK) < min)
            min = position->key & TILE_MASK;
    }
    return min;
}

static void take_column(trip_sharpen *s, uint64_t morton, trip_sharpen_column *column)
{
    *column = (trip_sharpen_column){ .sheet = s->sheet, .morton = morton };
    for (unsigned i = 0; i < TRIP_SHARPEN_SHEETS; i++) {
        const trip_level_position *position = next_position(s, i);
        if (!position || (position->key & TILE_MASK) != morton)
            continue;
        column->squares[i].square = *position;
        find_beside(s, &column->squares[i]);
        s->next[i]++;
    }
}

int trip_sharpen_take(trip_sharpen *s, trip_sharpen_column *column)
{
    uint64_t morton;
    while ((morton = next_morton(s)) == UINT64_MAX) {
        uint64_t first;
        int status = next_sheet(s, &first);
        if (status < 0 || first == UINT64_MAX)
            return status;
        s->sheet = first;
        memset(s->next, 0, sizeof s->next);
        status = trip_level_positions_look_ahead(&s->positions, first + TRIP_SHARPEN_SHEETS);
        if (status < 0)
            return status;
    }
    take_column(s, morton, column);
    return 1;
}
