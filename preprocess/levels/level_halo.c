#include "level_halo.h"

#include <stdlib.h>
#include <string.h>

#include "clones.h"
#include "format.h"
#include "report.h"

/* Number of squares held. */
enum { HELD = 64 };

/* A square of the file. `around` has a value for each voxel, by row; for a missing voxel it is
 * TRIP_COARSE_NONE_KEPT. */
typedef struct held_square {
    uint64_t key;
    bool held;
    uint16_t *around;
} held_square;

typedef struct adding {
    trip_level_positions positions;
    trip_output *to;
    const int64_t *dims;
    bool round; /* `around` holds turned codes */
    unsigned edge_log2;
    trip_budget *budget;
    unsigned char *memory;
    size_t bytes;
    trip_coarse_value *read, *values; /* voxels of a square: as in the file, and with its halo */
    /* Minima of `around`. `near` covers a square plus one voxel on each side, `rows` three voxels
     * of a row. */
    uint16_t *near, *rows;
    held_square squares[HELD];
    uint64_t *mortons; /* Morton codes of the candidate squares of a sheet, ascending */
    size_t room, count;
} adding;

static size_t edge_of(const adding *a)
{
    return (size_t)1 << a->edge_log2;
}

/* Lays out the memory. With NULL it only computes the bytes. */
static size_t lay_out(adding *a, unsigned char *memory)
{
    const size_t plane = edge_of(a) * edge_of(a), more = (edge_of(a) + 2) * (edge_of(a) + 2);
    size_t at = 0;
    a->read = trip_level_carve(memory, &at, plane * sizeof *a->read);
    a->values = trip_level_carve(memory, &at, plane * sizeof *a->values);
    a->near = trip_level_carve(memory, &at, more * sizeof *a->near);
    a->rows = trip_level_carve(memory, &at, more * sizeof *a->rows);
    for (int i = 0; i < HELD; i++)
        a->squares[i] = (held_square){ .around = trip_level_carve(
                                           memory, &at, plane * sizeof *a->squares[i].around) };
    return at;
}

uint64_t trip_level_halo_bytes(const int64_t dims[3], unsigned edge_log2, uint64_t voxels)
{
    adding a = { .edge_log2 = edge_log2 };
    const uint64_t positions = trip_level_positions_later_bytes(dims, edge_log2, voxels);
    const uint64_t squares = trip_level_positions_squares(dims, edge_log2, voxels);
    return positions + lay_out(&a, NULL) + 9 * 3 * squares * sizeof *a.mortons;
}

/* ---- candidate squares ---- */

static int compare(const void *a, const void *b)
{
    const uint64_t *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

static int make_room(adding *a, size_t count)
{
    if (count <= a->room)
        return 0;
    if (a->mortons)
        trip_budget_release(a->budget, a->mortons, a->room * sizeof *a->mortons);
    a->room = 0;
    a->mortons = trip_budget_take(a->budget, count * sizeof *a->mortons);
    if (!a->mortons)
        return trip_level_fail_memory();
    a->room = count;
    return 0;
}

static void add_about(adding *a, uint64_t key)
{
    for (int n = 0; n < 9; n++) {
        const int64_t u = trip_level_key_square(key, 0) + n % 3 - 1;
        const int64_t v = trip_level_key_square(key, 1) + n / 3 - 1;
        if (u >= 0 && v >= 0 && u << a->edge_log2 < a->dims[0] && v << a->edge_log2 < a->dims[1])
            a->mortons[a->count++] = trip_morton((uint32_t)u, (uint32_t)v);
    }
}

/* Collects the candidate squares of a sheet: squares of this sheet and of the sheets beside it,
 * each with its eight neighbours. */
static int find_squares(adding *a, uint64_t sheet)
{
    size_t positions = 0, kept = 0;
    a->count = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int n = -1; n <= 1; n++) {
            const trip_level_sheet *of =
                sheet + (uint64_t)n < (uint64_t)a->dims[2]
                    ? trip_level_positions_sheet(&a->positions, sheet + (uint64_t)n)
                    : NULL;
            for (size_t i = 0; of && pass == 1 && i < of->count; i++)
                add_about(a, of->positions[i].key);
            positions += of ? of->count : 0;
            if (pass == 0 && n == 1 && make_room(a, 9 * positions))
                return TRIP_ERROR;
        }
    qsort(a->mortons, a->count, sizeof *a->mortons, compare);
    for (size_t i = 0; i < a->count; i++)
        if (i == 0 || a->mortons[i] != a->mortons[i - 1])
            a->mortons[kept++] = a->mortons[i];
    a->count = kept;
    return 0;
}

/* ---- a square ---- */

static int read_voxels(const adding *a, const trip_level_position *position, trip_coarse_value *to)
{
    return trip_output_read(a->positions.file, position->at, to, position->count * sizeof *to);
}

static int hold(adding *a, const trip_level_position *position, const held_square **out)
{
    held_square *s = &a->squares[(position->key * UINT64_C(0x9e3779b97f4a7c15) >> 32) % HELD];
    *out = s;
    if (s->held && s->key == position->key)
        return 0;
    int status = read_voxels(a, position, a->read);
    s->key = position->key;
    s->held = status == 0;
    memset(s->around, 255, sizeof *s->around << 2 * a->edge_log2);
    for (uint32_t i = 0; i < position->count && status == 0; i++)
        s->around[((size_t)a->read[i].v << a->edge_log2) + a->read[i].u] = a->read[i].around;
    return status;
}

static uint16_t lesser(uint16_t a, uint16_t b)
{
    return a < b ? a : b;
}

/* Lowers `near` by the square at offset (u, v), as far as its voxels lie within one voxel of the
 * current square. */
static void take_near(adding *a, const held_square *s, int u, int v)
{
    const size_t edge = edge_of(a), across = edge + 2;
    const size_t first_u = u < 0 ? edge - 1 : 0, past_u = u > 0 ? 1 : edge;
    const size_t first_v = v < 0 ? edge - 1 : 0, past_v = v > 0 ? 1 : edge;
    const size_t to_u = u < 0 ? 0 : u > 0 ? edge + 1 : 1, to_v = v < 0 ? 0 : v > 0 ? edge + 1 : 1;
    for (size_t y = first_v; y < past_v; y++) {
        const uint16_t *from = s->around + y * edge;
        uint16_t *to = a->near + (to_v + y - first_v) * across + to_u;
        for (size_t x = first_u; x < past_u; x++)
            to[x - first_u] = lesser(to[x - first_u], from[x]);
    }
}

/* Computes the minima of 3 x 3 voxels. */
static void widen(adding *a)
{
    const size_t edge = edge_of(a), across = edge + 2;
    for (size_t y = 0; y < across; y++) {
        const uint16_t *from = a->near + y * across;
        for (size_t x = 0; x < edge; x++)
            a->rows[y * edge + x] = lesser(from[x], lesser(from[x + 1], from[x + 2]));
    }
    for (size_t y = 0; y < edge; y++)
        for (size_t x = 0; x < edge; x++) {
            const uint16_t *from = a->rows + y * edge + x;
            a->near[y * edge + x] = lesser(from[0], lesser(from[edge], from[2 * edge]));
        }
}

TRIP_ALSO_V3 static int find_near(adding *a, uint64_t key)
{
    int status = 0;
    memset(a->near, 255, sizeof *a->near * (edge_of(a) + 2) * (edge_of(a) + 2));
    for (int n = 0; n < 27 && status == 0; n++) {
        const int u = n % 3 - 1, v = n / 3 % 3 - 1;
        const trip_level_position position =
            trip_level_position_beside(&a->positions, key, u, v, n / 9 - 1);
        const held_square *square;
        if (position.count == 0)
            continue;
        status = hold(a, &position, &square);
        if (status == 0)
            take_near(a, square, u, v);
    }
    if (status == 0)
        widen(a);
    return status;
}

/* Returns the number of a square's voxels inside the grid, along u or v. */
static size_t within(const adding *a, uint64_t key, int axis)
{
    const int64_t edge = (int64_t)edge_of(a);
    const int64_t left = a->dims[axis] - trip_level_key_square(key, axis) * edge;
    return (size_t)(left < edge ? left : edge);
}

/* Merges the square's own voxels and the added voxels into `values`, by row. Returns their number.
 */
static uint32_t merge(adding *a, uint64_t key, uint32_t own)
{
    const size_t edge = edge_of(a), size[2] = { within(a, key, 0), within(a, key, 1) };
    uint32_t next = 0, count = 0;
    for (size_t y = 0; y < size[1]; y++)
        for (size_t x = 0; x < size[0]; x++) {
            const uint16_t min = a->near[y * edge + x];
            if (next < own && a->read[next].u == x && a->read[next].v == y)
                a->values[count++] = a->read[next++];
            else if (min < TRIP_COARSE_ALL_KEPT)
                a->values[count++] =
                    (trip_coarse_value){ .u = (uint8_t)x,
                                         .v = (uint8_t)y,
                                         .value = trip_coarse_turned(min, a->round),
                                         .around = TRIP_COARSE_NONE_KEPT };
        }
    return count;
}

static int add_square(adding *a, uint64_t key)
{
    const trip_level_position own = trip_level_position_beside(&a->positions, key, 0, 0, 0);
    const bool full = own.count == within(a, key, 0) * within(a, key, 1);
    int status = full ? 0 : find_near(a, key);
    if (status == 0 && own.count > 0)
        status = read_voxels(a, &own, full ? a->values : a->read);
    const uint32_t count = status < 0 ? 0 : full ? own.count : merge(a, key, own.count);
    if (count > 0)
        status = trip_level_file_append(a->to, key, a->values, NULL, count);
    return status;
}

static int add_sheet(adding *a, uint64_t sheet)
{
    int status = find_squares(a, sheet);
    for (size_t i = 0; i < a->count && status == 0; i++)
        status = add_square(a, sheet << TRIP_TILE_MORTON_BITS | a->mortons[i]);
    return status == 0 && trip_interrupted()
               ? trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted")
               : status;
}

/* Processes every sheet that has squares, and the sheets beside it. */
static int add_sheets(adding *a)
{
    uint64_t sheet = 0, next;
    int status = 0;
    while (status == 0) {
        status = trip_level_positions_look_ahead(&a->positions, sheet + 1);
        const bool about = trip_level_positions_sheet(&a->positions, sheet + 1) ||
                           trip_level_positions_sheet(&a->positions, sheet) ||
                           (sheet > 0 && trip_level_positions_sheet(&a->positions, sheet - 1));
        if (status == 0 && about && sheet < (uint64_t)a->dims[2])
            status = add_sheet(a, sheet);
        if (status == 0 && !about) {
            status = trip_level_positions_next(&a->positions, &next);
            if (next == UINT64_MAX)
                break;
            sheet = next - 1; /* at least one sheet further; the next one is known */
            continue;
        }
        sheet++;
    }
    return status;
}

int trip_level_halo_add(const trip_output *from, bool means, bool round, trip_output *to,
                        const int64_t dims[3], unsigned edge_log2, trip_budget *budget)
{
    adding a = { .to = to, .dims = dims, .round = round, .edge_log2 = edge_log2, .budget = budget };
    trip_level_positions_open(&a.positions, from, means, edge_log2, budget);
    a.bytes = lay_out(&a, NULL);
    a.memory = trip_budget_take(budget, a.bytes);
    int status = a.memory ? 0 : trip_level_fail_memory();
    if (status == 0) {
        lay_out(&a, a.memory);
        status = add_sheets(&a);
    }
    if (a.memory)
        trip_budget_release(budget, a.memory, a.bytes);
    if (a.mortons)
        trip_budget_release(budget, a.mortons, a.room * sizeof *a.mortons);
    trip_level_positions_close(&a.positions);
    return status;
}
