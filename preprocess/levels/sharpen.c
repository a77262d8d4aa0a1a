#include "sharpen.h"

#include <math.h>
#include <string.h>

#include "clones.h"
#include "format.h"
#include "report.h"

/* Squares in a lane besides the current one. */
enum { HELD = 32 };

static const uint64_t TILE_MASK = (UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1;

/* The arrays are in row order. */
struct trip_sharpen_square {
    uint64_t key;
    bool held;
    uint16_t *known; /* all bits set if the voxel exists, else 0 */
    uint16_t *values;
};

size_t trip_sharpen_lane_make(trip_sharpen_lane *l, unsigned edge_log2, unsigned char *memory)
{
    const size_t plane = (size_t)1 << 2 * edge_log2;
    size_t at = 0;
    l->values = trip_level_carve(memory, &at, plane * sizeof *l->values);
    l->beside = trip_level_carve(memory, &at, plane * sizeof *l->beside);
    l->sums = trip_level_carve(memory, &at, plane * sizeof *l->sums);
    l->value_sums = trip_level_carve(memory, &at, plane * sizeof *l->value_sums);
    l->square_sums = trip_level_carve(memory, &at, plane * sizeof *l->square_sums);
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

double trip_sharpen_shown(unsigned level)
{
    return (1 - ldexp(1, -2 * (int)level)) / 24;
}

/* Reads a square. `values` is a buffer of the lane. */
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

/* Adds squared differences to the neighbours that exist. They are whole numbers, hence exact. */
static void add_squares(double *restrict squares, const uint16_t *here, const uint16_t *others,
                        const uint16_t *known, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const double by = (here[i] & known[i]) - (others[i] & known[i]);
        squares[i] += by * by;
    }
}

/* Adds differences to the neighbours that exist. */
static void add_differences(int32_t *restrict sums, const uint16_t *here, const uint16_t *others,
                            const uint16_t *known, size_t count)
{
    for (size_t i = 0; i < count; i++)
        sums[i] += (here[i] & known[i]) - (others[i] & known[i]);
}

/* Adds differences of values, for knots. */
static void add_value_differences(double *restrict sums, const double *value_of,
                                  const uint16_t *here, const uint16_t *others,
                                  const uint16_t *here_known, const uint16_t *known, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (known[i] && here_known[i])
            sums[i] += value_of[here[i]] - value_of[others[i]];
}

/* Adds differences for a part of the current square: `count` rows from `row` on and `width` columns
 * from `column` on. The neighbours are `shift` entries further in the other square. */
static void add_beside(const trip_sharpen *s, trip_sharpen_lane *l,
                       const trip_sharpen_square *other, size_t row, size_t count, size_t column,
                       size_t width, ptrdiff_t shift)
{
    const trip_sharpen_square *here = &l->squares[0];
    for (size_t v = row; v < row + count; v++) {
        const size_t at = (v << s->edge_log2) + column;
        if (s->value_of)
            add_value_differences(l->value_sums + at, s->value_of, here->values + at,
                                  other->values + at + shift, here->known + at,
                                  other->known + at + shift, width);
        else
            add_differences(l->sums + at, here->values + at, other->values + at + shift,
                            other->known + at + shift, width);
        if (s->shown > 0)
            add_squares(l->square_sums + at, here->values + at, other->values + at + shift,
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

/* Adds the differences along u and v, within the current square and to the squares around it. Then
 * adds the differences to the previous and the next sheet. */
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

/* Returns value + sum / TRIP_SHARPEN_PART, rounded and clamped. */
static uint16_t sharpened(uint16_t value, int32_t sum)
{
    const int32_t half = sum < 0 ? -TRIP_SHARPEN_PART / 2 : TRIP_SHARPEN_PART / 2;
    const int32_t to = value + (sum + half) / TRIP_SHARPEN_PART;
    return (uint16_t)(to < 0 ? 0 : to > UINT16_MAX ? UINT16_MAX : to);
}

/* Returns the sharpened value of a voxel. A voxel that covers no known value is invisible, and only
 * moves away from visible values. */
static uint16_t sharpened_value(const trip_sharpen *s, const trip_sharpen_lane *l,
                                const trip_coarse_value *voxel)
{
    const size_t at = ((size_t)voxel->v << s->edge_log2) + voxel->u;
    if (s->value_of) {
        const double by = l->value_sums[at];
        const bool nearer = s->round ? by < 0 : by > 0;
        return voxel->known == 0 && nearer
                   ? voxel->value
                   : (uint16_t)trip_quantise(s->quantiser,
                                             s->value_of[voxel->value] + by / TRIP_SHARPEN_PART);
    }
    const int32_t sum = l->sums[at];
    const bool towards = s->round ? sum < 0 : sum > 0;
    return voxel->known == 0 && towards ? voxel->value : sharpened(voxel->value, sum);
}

/* Returns the variance without the part that interpolation shows. */
static float variance_left(const trip_sharpen *s, const trip_sharpen_lane *l,
                           const trip_coarse_value *voxel)
{
    const size_t at = ((size_t)voxel->v << s->edge_log2) + voxel->u;
    const double left = (double)voxel->variance - s->shown * l->square_sums[at];
    return (float)(left > 0 ? left : 0);
}

TRIP_ALSO_V3 int trip_sharpen_do(const trip_sharpen *s, trip_sharpen_lane *l,
                                 const trip_sharpen_neighbourhood *of)
{
    const trip_level_position *position = &of->square;
    int status = read_square(s, position, l->values, &l->squares[0]);
    if (s->labels || (s->quantiser && s->quantiser->ids))
        return status;
    memset(l->sums, 0, sizeof *l->sums << 2 * s->edge_log2);
    memset(l->value_sums, 0, sizeof *l->value_sums << 2 * s->edge_log2);
    if (s->shown > 0)
        memset(l->square_sums, 0, sizeof *l->square_sums << 2 * s->edge_log2);
    if (status == 0)
        status = add_around(s, l, of->beside);
    for (uint32_t i = 0; i < position->count && status == 0; i++) {
        l->values[i].value = sharpened_value(s, l, &l->values[i]);
        if (s->shown > 0)
            l->values[i].variance = variance_left(s, l, &l->values[i]);
    }
    return status;
}

/* Finds the first sheet of the next columns; UINT64_MAX if there are none. */
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

/* Returns the next square of sheet `i` of the current columns, or NULL after its last one. */
static const trip_level_position *next_position(const trip_sharpen *s, unsigned i)
{
    const trip_level_sheet *sheet = trip_level_positions_sheet(&s->positions, s->sheet + i);
    return sheet && s->next[i] < sheet->count ? &sheet->positions[s->next[i]] : NULL;
}

/* Returns the Morton code of the next column in the current sheets, or UINT64_MAX after the last
 * one. */
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
