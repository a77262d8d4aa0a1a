#include "level_positions.h"

#include <string.h>

#include "format.h"
#include "report.h"

enum { MIN_ROOM = 64 };

void trip_level_positions_open(trip_level_positions *p, const trip_output *file, bool means,
                               unsigned edge_log2, trip_budget *budget)
{
    *p = (trip_level_positions){
        .budget = budget, .file = file, .means = means, .edge_log2 = edge_log2
    };
    for (unsigned i = 0; i < TRIP_LEVEL_SHEETS_HELD; i++)
        p->sheets[i].number = UINT64_MAX;
}

void trip_level_positions_close(trip_level_positions *p)
{
    for (unsigned i = 0; i < TRIP_LEVEL_SHEETS_HELD; i++)
        if (p->sheets[i].positions)
            trip_budget_release(p->budget, p->sheets[i].positions,
                                p->sheets[i].room * sizeof *p->sheets[i].positions);
    *p = (trip_level_positions){ 0 };
}

uint64_t trip_level_positions_squares(const int64_t dims[3], unsigned edge_log2, uint64_t voxels)
{
    uint64_t across = (uint64_t)(dims[0] - 1) >> edge_log2;
    uint64_t squares = (across + 1) * (((uint64_t)(dims[1] - 1) >> edge_log2) + 1);
    if (squares > voxels)
        squares = voxels;
    return squares < MIN_ROOM ? MIN_ROOM : squares;
}

/* Counts twice the contents for the array of each sheet, and one array more for the copy when an
 * array grows. */
uint64_t trip_level_positions_later_bytes(const int64_t dims[3], unsigned edge_log2,
                                          uint64_t voxels)
{
    const uint64_t squares = trip_level_positions_squares(dims, edge_log2, voxels);
    return (2 * TRIP_LEVEL_SHEETS_HELD + 1) * squares * sizeof(trip_level_position);
}

static int add_position(trip_level_positions *p, trip_level_sheet *sheet,
                        trip_level_position position)
{
    if (sheet->count == sheet->room) {
        const size_t room = sheet->room ? 2 * sheet->room : MIN_ROOM,
                     size = sizeof *sheet->positions;
        trip_level_position *positions = trip_budget_take(p->budget, room * size);
        if (!positions)
            return trip_level_fail_memory();
        if (sheet->count > 0)
            memcpy(positions, sheet->positions, sheet->count * size);
        trip_budget_release(p->budget, sheet->positions, sheet->room * size);
        sheet->positions = positions;
        sheet->room = room;
    }
    sheet->positions[sheet->count++] = position;
    return 0;
}

int trip_level_positions_look_ahead(trip_level_positions *p, uint64_t last)
{
    int status = 0;
    while (status == 0 && p->ahead < p->file->bytes) {
        trip_level_position position = { 0 };
        status =
            trip_level_file_square(p->file, p->ahead, p->edge_log2, &position.key, &position.count);
        const uint64_t number = position.key >> TRIP_TILE_MORTON_BITS;
        if (status < 0 || number > last)
            break;
        trip_level_sheet *sheet = &p->sheets[number % TRIP_LEVEL_SHEETS_HELD];
        if (sheet->number != number)
            sheet->count = 0;
        sheet->number = number;
        position.at = p->ahead + TRIP_LEVEL_SQUARE_BYTES;
        p->ahead = position.at + trip_level_voxels_bytes(position.count, p->means);
        status = add_position(p, sheet, position);
    }
    return status;
}

int trip_level_positions_next(const trip_level_positions *p, uint64_t *sheet)
{
    uint64_t key;
    uint32_t count;
    *sheet = UINT64_MAX;
    if (p->ahead >= p->file->bytes)
        return 0;
    int status = trip_level_file_square(p->file, p->ahead, p->edge_log2, &key, &count);
    *sheet = key >> TRIP_TILE_MORTON_BITS;
    return status;
}

/* Returns a square, or NULL if it has no voxels. */
static const trip_level_position *find_position(const trip_level_positions *p, uint64_t key)
{
    const trip_level_sheet *sheet = trip_level_positions_sheet(p, key >> TRIP_TILE_MORTON_BITS);
    size_t first = 0, past = sheet ? sheet->count : 0;
    while (first < past) {
        const size_t middle = first + (past - first) / 2;
        if (sheet->positions[middle].key == key)
            return &sheet->positions[middle];
        if (sheet->positions[middle].key < key)
            first = middle + 1;
        else
            past = middle;
    }
    return NULL;
}

int64_t trip_level_key_square(uint64_t key, int axis)
{
    const uint64_t morton = key & ((UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1);
    return trip_morton_even(morton >> axis);
}

trip_level_position trip_level_position_beside(const trip_level_positions *p, uint64_t key,
                                               int64_t u, int64_t v, int64_t sheet)
{
    const trip_level_position *position = NULL;
    u += trip_level_key_square(key, 0);
    v += trip_level_key_square(key, 1);
    sheet += (int64_t)(key >> TRIP_TILE_MORTON_BITS);
    if (u >= 0 && v >= 0 && sheet >= 0)
        position = find_position(p, (uint64_t)sheet << TRIP_TILE_MORTON_BITS |
                                        trip_morton((uint32_t)u, (uint32_t)v));
    return position ? *position : (trip_level_position){ 0 };
}
