#include "level_places.h"

#include <string.h>

#include "format.h"
#include "report.h"

enum { LEAST_ROOM = 64 };

void trip_level_places_open(trip_level_places *p, const trip_output *file, bool means,
                            unsigned edge_log2, trip_budget *budget)
{
    *p = (trip_level_places){
        .budget = budget, .file = file, .means = means, .edge_log2 = edge_log2
    };
    for (unsigned i = 0; i < TRIP_LEVEL_SHEETS_HELD; i++)
        p->sheets[i].number = UINT64_MAX;
}

void trip_level_places_close(trip_level_places *p)
{
    for (unsigned i = 0; i < TRIP_LEVEL_SHEETS_HELD; i++)
        if (p->sheets[i].places)
            trip_budget_release(p->budget, p->sheets[i].places,
                                p->sheets[i].room * sizeof *p->sheets[i].places);
    *p = (trip_level_places){ 0 };
}

uint64_t trip_level_places_squares(const int64_t dims[3], unsigned edge_log2, uint64_t voxels)
{
    uint64_t across = (uint64_t)(dims[0] - 1) >> edge_log2;
    uint64_t squares = (across + 1) * (((uint64_t)(dims[1] - 1) >> edge_log2) + 1);
    if (squares > voxels)
        squares = voxels;
    return squares < LEAST_ROOM ? LEAST_ROOM : squares;
}

/* Sheets, in arrays that are up to twice as long as what they hold, and one that is copied. */
uint64_t trip_level_places_later_bytes(const int64_t dims[3], unsigned edge_log2, uint64_t voxels)
{
    const uint64_t squares = trip_level_places_squares(dims, edge_log2, voxels);
    return (2 * TRIP_LEVEL_SHEETS_HELD + 1) * squares * sizeof(trip_level_place);
}

static int add_place(trip_level_places *p, trip_level_sheet *sheet, trip_level_place place)
{
    if (sheet->count == sheet->room) {
        const size_t room = sheet->room ? 2 * sheet->room : LEAST_ROOM,
                     size = sizeof *sheet->places;
        trip_level_place *places = trip_budget_take(p->budget, room * size);
        if (!places)
            return trip_level_fail_memory();
        if (sheet->count > 0)
            memcpy(places, sheet->places, sheet->count * size);
        trip_budget_release(p->budget, sheet->places, sheet->room * size);
        sheet->places = places;
        sheet->room = room;
    }
    sheet->places[sheet->count++] = place;
    return 0;
}

int trip_level_places_look_ahead(trip_level_places *p, uint64_t last)
{
    int status = 0;
    while (status == 0 && p->ahead < p->file->bytes) {
        trip_level_place place = { 0 };
        status = trip_level_file_square(p->file, p->ahead, p->edge_log2, &place.key, &place.count);
        const uint64_t number = place.key >> TRIP_TILE_MORTON_BITS;
        if (status < 0 || number > last)
            break;
        trip_level_sheet *sheet = &p->sheets[number % TRIP_LEVEL_SHEETS_HELD];
        if (sheet->number != number)
            sheet->count = 0;
        sheet->number = number;
        place.at = p->ahead + TRIP_LEVEL_SQUARE_BYTES;
        p->ahead = place.at + trip_level_voxels_bytes(place.count, p->means);
        status = add_place(p, sheet, place);
    }
    return status;
}

int trip_level_places_next(const trip_level_places *p, uint64_t *sheet)
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

/* NULL: it has no voxels. */
static const trip_level_place *find_place(const trip_level_places *p, uint64_t key)
{
    const trip_level_sheet *sheet = trip_level_places_sheet(p, key >> TRIP_TILE_MORTON_BITS);
    size_t first = 0, past = sheet ? sheet->count : 0;
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

int64_t trip_level_key_square(uint64_t key, int axis)
{
    const uint64_t morton = key & ((UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1);
    return trip_morton_even(morton >> axis);
}

trip_level_place trip_level_place_beside(const trip_level_places *p, uint64_t key, int64_t u,
                                         int64_t v, int64_t sheet)
{
    const trip_level_place *place = NULL;
    u += trip_level_key_square(key, 0);
    v += trip_level_key_square(key, 1);
    sheet += (int64_t)(key >> TRIP_TILE_MORTON_BITS);
    if (u >= 0 && v >= 0 && sheet >= 0)
        place = find_place(p, (uint64_t)sheet << TRIP_TILE_MORTON_BITS |
                                  trip_morton((uint32_t)u, (uint32_t)v));
    return place ? *place : (trip_level_place){ 0 };
}
