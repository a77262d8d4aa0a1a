#include "sharpen.h"

#include <string.h>

#include "format.h"
#include "level_source.h"
#include "report.h"

/* Squares held besides the one at hand. */
enum { HELD = 32 };

static const uint64_t TILE_MASK = (UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1;

/* By row. */
struct trip_sharpen_square {
    uint64_t key;
    bool held;
    uint64_t *known; /* bits */
    uint16_t *values;
};

static int fail_memory(void)
{
    return trip_fail(
        TRIP_ERROR, "brick", "levels",
        "need more memory: give more with --memory, or leave them out with --levels 0");
}

static void *part(unsigned char *memory, size_t *at, size_t bytes)
{
    void *p = memory ? memory + *at : NULL;
    *at += (bytes + 63) & ~(size_t)63;
    return p;
}

/* Returns the bytes; with memory NULL it computes these only. */
static size_t lay_out(trip_sharpen *s, unsigned char *memory)
{
    const size_t plane = (size_t)1 << 2 * s->edge_log2;
    size_t at = 0;
    s->voxels = part(memory, &at, plane * sizeof *s->voxels);
    s->sums = part(memory, &at, plane * sizeof *s->sums);
    s->squares = part(memory, &at, (1 + HELD) * sizeof *s->squares);
    for (int i = 0; i < 1 + HELD; i++) {
        uint64_t *known = part(memory, &at, plane / 8);
        uint16_t *values = part(memory, &at, plane * sizeof *values);
        if (memory)
            s->squares[i] = (trip_sharpen_square){ .known = known, .values = values };
    }
    return at;
}

int trip_sharpen_open(trip_sharpen *s, const trip_output *file, unsigned edge_log2, uint16_t least,
                      uint16_t most, trip_budget *budget)
{
    *s = (trip_sharpen){
        .budget = budget, .file = file, .edge_log2 = edge_log2, .least = least, .most = most
    };
    for (unsigned i = 0; i < 3; i++)
        s->sheets[i].number = UINT64_MAX;
    s->bytes = lay_out(s, NULL);
    s->memory = trip_budget_take(budget, s->bytes);
    if (!s->memory)
        return fail_memory();
    lay_out(s, s->memory);
    return 0;
}

void trip_sharpen_close(trip_sharpen *s)
{
    for (unsigned i = 0; i < 3; i++)
        if (s->sheets[i].places)
            trip_budget_release(s->budget, s->sheets[i].places,
                                s->sheets[i].room * sizeof *s->sheets[i].places);
    if (s->memory)
        trip_budget_release(s->budget, s->memory, s->bytes);
    *s = (trip_sharpen){ 0 };
}

/* ---- where squares lie ---- */

enum { LEAST_ROOM = 64 };

/* Three sheets, in arrays that are up to twice as long as what they hold, and one that is copied.
 */
uint64_t trip_sharpen_later_bytes(const int64_t dims[3], unsigned edge_log2, uint64_t voxels)
{
    uint64_t across = (uint64_t)(dims[0] - 1) >> edge_log2;
    uint64_t squares = (across + 1) * (((uint64_t)(dims[1] - 1) >> edge_log2) + 1);
    if (squares > voxels)
        squares = voxels;
    if (squares < LEAST_ROOM)
        squares = LEAST_ROOM;
    return 7 * squares * sizeof(struct trip_sharpen_place);
}

static int add_place(trip_sharpen *s, trip_sharpen_sheet *sheet, struct trip_sharpen_place place)
{
    if (sheet->count == sheet->room) {
        const size_t room = sheet->room ? 2 * sheet->room : LEAST_ROOM,
                     size = sizeof *sheet->places;
        struct trip_sharpen_place *places = trip_budget_take(s->budget, room * size);
        if (!places)
            return fail_memory();
        if (sheet->count > 0)
            memcpy(places, sheet->places, sheet->count * size);
        trip_budget_release(s->budget, sheet->places, sheet->room * size);
        sheet->places = places;
        sheet->room = room;
    }
    sheet->places[sheet->count++] = place;
    return 0;
}

/* Goes on in the file until all squares of sheets up to `last` are known; at least the next one's.
 */
static int look_ahead(trip_sharpen *s, uint64_t last)
{
    int status = 0;
    while (status == 0 && s->ahead < s->file->bytes) {
        struct trip_sharpen_place place = { 0 };
        status = trip_level_file_square(s->file, s->ahead, s->edge_log2, &place.key, &place.count);
        const uint64_t number = place.key >> TRIP_TILE_MORTON_BITS;
        if (status < 0 || number > last)
            break;
        trip_sharpen_sheet *sheet = &s->sheets[number % 3];
        if (sheet->number != number)
            sheet->count = 0;
        sheet->number = number;
        place.at = s->ahead + TRIP_LEVEL_SQUARE_BYTES;
        s->ahead = place.at + place.count * sizeof *s->voxels;
        status = add_place(s, sheet, place);
    }
    return status;
}

/* NULL: it has no voxels. */
static const struct trip_sharpen_place *find_place(const trip_sharpen *s, uint64_t key)
{
    const uint64_t number = key >> TRIP_TILE_MORTON_BITS;
    const trip_sharpen_sheet *sheet = &s->sheets[number % 3];
    size_t first = 0, past = sheet->number == number ? sheet->count : 0;
    while (first < past) {
        const size_t middle = first + (past - first) / 2;
        if (sheet->places[middle].key == key)
            return &sheet->places[middle];
        if (sheet->places[middle].key < key)
            first = middle + 1;
        else
            past = middle;
    }
    return NULL;
}

/* ---- squares ---- */

static int read_square(trip_sharpen *s, const struct trip_sharpen_place *place,
                       trip_sharpen_square *to)
{
    int status = trip_output_read(s->file, place->at, s->voxels, place->count * sizeof *s->voxels);
    to->key = place->key;
    to->held = status == 0;
    memset(to->known, 0, (size_t)1 << (2 * s->edge_log2 - 3));
    for (uint32_t i = 0; i < place->count && status == 0; i++) {
        const size_t at = ((size_t)s->voxels[i].v << s->edge_log2) + s->voxels[i].u;
        to->known[at / 64] |= UINT64_C(1) << at % 64;
        to->values[at] = s->voxels[i].value;
    }
    return status;
}

/* NULL: it has no voxels. */
static int hold_square(trip_sharpen *s, uint64_t key, const trip_sharpen_square **out)
{
    const struct trip_sharpen_place *place = find_place(s, key);
    trip_sharpen_square *square =
        &s->squares[1 + (key * UINT64_C(0x9e3779b97f4a7c15) >> 32) % HELD];
    *out = place ? square : NULL;
    if (!place || (square->held && square->key == key))
        return 0;
    return read_square(s, place, square);
}

/* Of the square at hand the voxels of `count` rows from `row` on and of `width` columns from
 * `column` on, with those of another that are `shift` further. */
static void add_beside(trip_sharpen *s, const trip_sharpen_square *other, size_t row, size_t count,
                       size_t column, size_t width, ptrdiff_t shift)
{
    const trip_sharpen_square *here = &s->squares[0];
    for (size_t v = row; v < row + count; v++)
        for (size_t u = column; u < column + width; u++) {
            const size_t at = (v << s->edge_log2) + u, to = (size_t)((ptrdiff_t)at + shift);
            if (other->known[to / 64] >> to % 64 & 1)
                s->sums[at] += here->values[at] - other->values[to];
        }
}

static uint64_t key_of(uint64_t sheet, int64_t u, int64_t v)
{
    return sheet << TRIP_TILE_MORTON_BITS | trip_morton((uint32_t)u, (uint32_t)v);
}

static int add_square(trip_sharpen *s, uint64_t key, size_t row, size_t count, size_t column,
                      size_t width, ptrdiff_t shift)
{
    const trip_sharpen_square *other;
    int status = hold_square(s, key, &other);
    if (status == 0 && other)
        add_beside(s, other, row, count, column, width, shift);
    return status;
}

static int64_t even_bits(uint64_t m)
{
    int64_t n = 0;
    for (int bit = 0; bit < TRIP_TILE_MORTON_BITS / 2; bit++)
        n |= (int64_t)(m >> 2 * bit & 1) << bit;
    return n;
}

/* Along u and v, within the square at hand and from those around it. */
static int add_around(trip_sharpen *s, uint64_t key)
{
    const size_t edge = (size_t)1 << s->edge_log2, last = edge - 1;
    const ptrdiff_t down = (ptrdiff_t)edge, across = (ptrdiff_t)last;
    const int64_t u = even_bits(key & TILE_MASK), v = even_bits((key & TILE_MASK) >> 1);
    const uint64_t sheet = key >> TRIP_TILE_MORTON_BITS;
    int status = 0;
    add_beside(s, &s->squares[0], 0, edge, 1, last, -1);
    add_beside(s, &s->squares[0], 0, edge, 0, last, 1);
    add_beside(s, &s->squares[0], 1, last, 0, edge, -down);
    add_beside(s, &s->squares[0], 0, last, 0, edge, down);
    if (u > 0)
        status = add_square(s, key_of(sheet, u - 1, v), 0, edge, 0, 1, across);
    if (status == 0)
        status = add_square(s, key_of(sheet, u + 1, v), 0, edge, last, 1, -across);
    if (status == 0 && v > 0)
        status = add_square(s, key_of(sheet, u, v - 1), 0, 1, 0, edge, across * down);
    if (status == 0)
        status = add_square(s, key_of(sheet, u, v + 1), last, 1, 0, edge, -across * down);
    return status;
}

static int add_sheets(trip_sharpen *s, uint64_t key)
{
    const uint64_t one = UINT64_C(1) << TRIP_TILE_MORTON_BITS;
    const size_t edge = (size_t)1 << s->edge_log2;
    int status = key >= one ? add_square(s, key - one, 0, edge, 0, edge, 0) : 0;
    return status == 0 ? add_square(s, key + one, 0, edge, 0, edge, 0) : status;
}

/* value + sum / TRIP_SHARPEN_PART, the nearest. */
static uint16_t sharpened(const trip_sharpen *s, uint16_t value, int32_t sum)
{
    const int32_t half = sum < 0 ? -TRIP_SHARPEN_PART / 2 : TRIP_SHARPEN_PART / 2;
    const int32_t to = value + (sum + half) / TRIP_SHARPEN_PART;
    return (uint16_t)(to < s->least ? s->least : to > s->most ? s->most : to);
}

static int sharpen_square(trip_sharpen *s, const struct trip_sharpen_place *place)
{
    int status = read_square(s, place, &s->squares[0]);
    memset(s->sums, 0, sizeof *s->sums << 2 * s->edge_log2);
    if (status == 0)
        status = add_around(s, place->key);
    if (status == 0)
        status = add_sheets(s, place->key);
    if (status == 0) /* others were read into the same memory */
        status = trip_output_read(s->file, place->at, s->voxels, place->count * sizeof *s->voxels);
    for (uint32_t i = 0; i < place->count && status == 0; i++) {
        trip_coarse_voxel *voxel = &s->voxels[i];
        voxel->value =
            sharpened(s, voxel->value, s->sums[((size_t)voxel->v << s->edge_log2) + voxel->u]);
    }
    return status;
}

/* The number of the next sheet with squares, UINT64_MAX when there is none. */
static int next_sheet(trip_sharpen *s, uint64_t *number)
{
    const uint64_t here = s->sheet;
    uint32_t count;
    uint64_t key = UINT64_MAX;
    *number = UINT64_MAX;
    if (s->next > 0 && s->sheets[(here + 1) % 3].number == here + 1) {
        *number = here + 1;
        return 0;
    }
    if (s->ahead >= s->file->bytes)
        return 0;
    int status = trip_level_file_square(s->file, s->ahead, s->edge_log2, &key, &count);
    *number = key >> TRIP_TILE_MORTON_BITS;
    return status;
}

int trip_sharpen_next(trip_sharpen *s, uint64_t *key, trip_coarse_voxel **voxels, uint32_t *count)
{
    const trip_sharpen_sheet *sheet = &s->sheets[s->sheet % 3];
    if (sheet->number != s->sheet || s->next == sheet->count) {
        uint64_t number;
        int status = next_sheet(s, &number);
        if (status < 0 || number == UINT64_MAX)
            return status;
        s->sheet = number;
        s->next = 0;
        status = look_ahead(s, number + 1);
        if (status < 0)
            return status;
        sheet = &s->sheets[number % 3];
    }
    const struct trip_sharpen_place *place = &sheet->places[s->next++];
    *key = place->key;
    *voxels = s->voxels;
    *count = place->count;
    int status = sharpen_square(s, place);
    return status < 0 ? status : 1;
}
