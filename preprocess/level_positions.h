/* Where the squares lie of a file that trip_level_file_append() writes, of a few sheets that follow
 * one another. One thread goes on in the file; meanwhile no other looks a square up. */
#ifndef TRIP_LEVEL_POSITIONS_H
#define TRIP_LEVEL_POSITIONS_H

#include "budget.h"
#include "level_source.h"
#include "output.h"

typedef struct trip_level_position {
    uint64_t key, at; /* in the file: of its voxels */
    uint32_t count;
} trip_level_position;

/* The squares of a sheet, by ascending key. */
typedef struct trip_level_sheet {
    uint64_t number;
    trip_level_position *positions;
    size_t count, room;
} trip_level_sheet;

enum { TRIP_LEVEL_SHEETS_HELD = 10 };

typedef struct trip_level_positions {
    trip_budget *budget;
    const trip_output *file;
    bool means; /* the file has them */
    unsigned edge_log2;
    uint64_t ahead; /* in the file: the first square that is not in a sheet below */
    trip_level_sheet sheets[TRIP_LEVEL_SHEETS_HELD]; /* by number, modulo their number */
} trip_level_positions;

/* Of a file with squares of 2^edge_log2 voxels, with means or without. The file is complete and
 * flushed before any is looked for. */
void trip_level_positions_open(trip_level_positions *p, const trip_output *file, bool means,
                               unsigned edge_log2, trip_budget *budget);
void trip_level_positions_close(trip_level_positions *p);

/* Squares of a sheet, at most, of a level of at most so many voxels; and what these take of the
 * budget later. */
uint64_t trip_level_positions_squares(const int64_t dims[3], unsigned edge_log2, uint64_t voxels);
uint64_t trip_level_positions_later_bytes(const int64_t dims[3], unsigned edge_log2,
                                          uint64_t voxels);

/* Goes on in the file until all squares of sheets up to `last` are known, which takes the place of
 * what was known of sheets that many before. */
int trip_level_positions_look_ahead(trip_level_positions *p, uint64_t last);
/* The sheet of the first square behind those; UINT64_MAX: there is none. */
int trip_level_positions_next(const trip_level_positions *p, uint64_t *sheet);

/* NULL: nothing is known of it. */
static inline const trip_level_sheet *trip_level_positions_sheet(const trip_level_positions *p,
                                                                 uint64_t number)
{
    const trip_level_sheet *sheet = &p->sheets[number % TRIP_LEVEL_SHEETS_HELD];
    return sheet->number == number ? sheet : NULL;
}

/* Of the square that lies so many squares and sheets further than that of the key; where there is
 * none its count is 0. */
trip_level_position trip_level_position_beside(const trip_level_positions *p, uint64_t key,
                                               int64_t u, int64_t v, int64_t sheet);

/* Along u (0) or v (1): which square of its sheet it is. */
int64_t trip_level_key_square(uint64_t key, int axis);

#endif
